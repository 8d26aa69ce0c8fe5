"""`rampe-guard init`: what it writes, what it asks, what it refuses."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console

from rampe_guard.core.drive import CylinderDrive
from rampe_guard.errors import LogError, SettingsError
from rampe_guard.programs.initing import init
from rampe_guard.programs.initing_plan import LAG_UNSEEN_S
from rampe_guard.programs.initing_questions import cylinder
from rampe_guard.programs.initing_wishes import Wishes
from rampe_guard.programs.measuring import heard_in_file, traces_of
from rampe_guard.programs.measuring_csv import column_maps
from rampe_guard.runtime.stopping import StopFlag
from rampe_guard.settings import load_site
from tests.support import small_arm
from tests.support.processes import called

BENCH_LOG = Path(__file__).parents[1] / "replay" / "bench.mcap"
COLUMNS = ("--time", "t", "--joystick", "a0,a1,a2", "--actuators", "turn,lift,reach")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the URDF and a log of its machine; the site goes beside it."""
    folder = tmp_path_factory.mktemp("init")
    small_arm.write_urdf(folder)
    moments = small_arm.ticks(rate_hz=25.0)
    small_arm.write_log(folder / "log.csv", moments)
    small_arm.write_log(folder / "short.csv", moments[:100])
    return folder


def _init(place: Path, out: Path, *more: str) -> tuple[int, str, str]:
    done = called("init", place / "small_arm.urdf", "--out", out, "--yes", *more)
    return done.returncode, done.stdout, done.stderr


def test_a_log_becomes_a_site(place: Path, tmp_path: Path) -> None:
    code, out, err = _init(place, tmp_path / "site", "--log", str(place / "log.csv"), *COLUMNS)
    assert (code, err) == (0, "")
    assert "ok: this site can be guarded" in out
    site = load_site(tmp_path / "site" / "site.yaml")
    assert (site.name, site.machine) == ("my-site", "small-arm")
    assert [a.name for a in site.guard.actuators] == ["turn", "lift", "reach"]
    assert [(a.axis, a.sign, a.unit) for a in site.guard.actuators] == [
        (2, 1, "rad"),
        (0, -1, "rad"),
        (1, 1, "m"),
    ]
    for true, made in zip(small_arm.ACTUATORS, site.guard.actuators, strict=True):
        assert true.max_velocity <= made.max_velocity < 2.1 * true.max_velocity
        assert true.lag_s <= made.lag_s < true.lag_s + 0.15
        assert 0.5 * true.max_deceleration < made.max_deceleration < 1.1 * true.max_deceleration
        assert made.deadband <= true.deadband
    text = (tmp_path / "site" / "site.yaml").read_text()
    assert "measured: 4 onsets, median" in text
    assert "TODO not measured" in text  # the deadband of reach: only full pushes were seen
    scene = (tmp_path / "site" / "scene.yaml").read_text()
    assert "offset_m: 0" in scene
    assert "ignore_links: [foot]" in scene


def test_a_log_of_ours_needs_no_columns(place: Path, tmp_path: Path) -> None:
    log = tmp_path / "ours.csv"
    head, _, rest = (place / "log.csv").read_text().partition("\n")
    for name, axis in (("turn", "a2"), ("lift", "a0"), ("reach", "a1")):
        head = head.replace(axis, f"u_{name}")
    log.write_text(f"{head}\n{rest}")
    assert _init(place, tmp_path, "--log", str(log))[0] == 0
    site = load_site(tmp_path / "site.yaml")
    assert [(a.name, a.axis) for a in site.guard.actuators] == [
        ("turn", 0),
        ("lift", 1),
        ("reach", 2),
    ]
    assert "in the URDF's order" not in (tmp_path / "site.yaml").read_text()


def test_the_log_replays_with_the_site(place: Path, tmp_path: Path) -> None:
    """What was written guards: a wall that is put into the scene is warned of."""
    log = ("--log", str(place / "log.csv"))
    assert _init(place, tmp_path, *log, *COLUMNS)[0] == 0
    scene = tmp_path / "scene.yaml"
    wall = "  - {name: wall, type: box, size: [0.2, 4, 2], pose: {xyz: [1.1, 0, 1]}}\n"
    scene.write_text(scene.read_text() + wall)
    done = called("replay", tmp_path / "site.yaml", place / "short.csv")
    assert done.returncode == 0
    alerts = [json.loads(line) for line in done.stdout.splitlines()]
    assert {alert["zone"] for alert in alerts} >= {"wall"}


def test_without_a_recording_all_is_to_do(place: Path, tmp_path: Path) -> None:
    code, out, _ = _init(place, tmp_path)
    assert code == 0
    site = load_site(tmp_path / "site.yaml")
    assert [a.max_velocity for a in site.guard.actuators] == [2.0, 2.0, 1.0]  # of the URDF
    assert {a.lag_s for a in site.guard.actuators} == {LAG_UNSEEN_S}
    assert (tmp_path / "site.yaml").read_text().count("TODO") > 3 * 6
    assert "?" in out


def test_nothing_is_overwritten(place: Path, tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("mine")
    code, _, err = _init(place, tmp_path)
    assert code == 2
    assert "scene.yaml already" in err
    assert (tmp_path / "scene.yaml").read_text() == "mine"
    assert _init(place, tmp_path, "--force")[0] == 0
    assert (tmp_path / "scene.yaml").read_text() != "mine"


def test_joints_in_another_order(place: Path, tmp_path: Path) -> None:
    columns = (*COLUMNS[:4], "--actuators", "reach,turn,lift")
    log = ("--log", str(place / "log.csv"))
    told = ("--joints", "reach,turn,lift")
    assert _init(place, tmp_path, *log, *columns, *told)[0] == 0
    site = load_site(tmp_path / "site.yaml")
    assert [a.axis for a in site.guard.actuators] == [1, 2, 0]
    assert [j.joint for j in site.arm.joints] == ["reach", "turn", "lift"]
    # taken for positions of other joints, they are beyond the limits of those
    wrong = ("--joints", "turn,lift,reach", "--force")
    _, out, _ = _init(place, tmp_path, *log, *columns, *wrong)
    assert "beyond the URDF's" in out


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (("--joints", "turn,lift,grip"), "no movable joint 'grip'; it has turn, lift, reach"),
        (("--joints", "turn,turn"), "turn is named twice"),
        (("--names", "a,b"), "--names gives 2 names for 3 actuators"),
        (("--cylinder", "lift=1"), "give base_m,rod_m,length_at_zero_m"),
        (("--cylinder", "gripper=1,2,1.5"), "'gripper' is no actuator"),
        (("--log", "none.csv"), "none.csv: cannot be read"),
        (("--connect", "tcp/127.0.0.1:1"), "give --joystick KEY and --actuators KEY"),
    ],
)
def test_what_cannot_be_is_said(
    place: Path, tmp_path: Path, more: tuple[str, ...], said: str
) -> None:
    code, _, err = _init(place, tmp_path, *more)
    assert code == 2
    assert said in err
    assert "Traceback" not in err
    assert not (tmp_path / "site.yaml").exists()


def test_joints_must_be_as_many_as_positions(place: Path, tmp_path: Path) -> None:
    log = ("--log", str(place / "log.csv"), *COLUMNS)
    code, _, err = _init(place, tmp_path, *log, "--joints", "turn,lift")
    assert code == 2
    assert "--joints names 2 joints, and messages have 3 positions" in err


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (("--time", "t", "--joystick", "a0", "--actuators", "no"), "no column 'no'"),
        (("--time", "t", "--joystick", "a0,a1", "--actuators", "turn,lift,reach"), "2 axes"),
        (("--time", "turn", *COLUMNS[2:]), "time does not go on"),
        (("--time", "t", "--joystick", "a0:9,a1,a2", *COLUMNS[4:]), "an axis is -1 to 1"),
        (("--time", "t", "--joystick", "a0:x,a1,a2", *COLUMNS[4:]), "is no column; write NAME"),
        ((), "name the columns, in their order, with --joystick and --actuators"),
    ],
)
def test_columns_that_cannot_be_are_said(
    place: Path, tmp_path: Path, columns: tuple[str, ...], said: str
) -> None:
    code, _, err = _init(place, tmp_path, "--log", str(place / "log.csv"), *columns)
    assert code == 2
    assert said in err


def test_an_actuator_with_a_cylinder(place: Path, tmp_path: Path) -> None:
    given = "lift=0.4,0.3,0.3,-0.6,1"
    assert _init(place, tmp_path, "--cylinder", given)[0] == 0
    lift = load_site(tmp_path / "site.yaml").arm.joints[1]
    assert lift.drive == CylinderDrive(0.4, 0.3, 0.3, -0.6, 1)


@pytest.mark.parametrize("text", ["1,2", "1,2,x", "0,1,1", "1,1,1,0,2", "1,1,1,0,1,9", ""])
def test_a_cylinder_that_is_none(text: str) -> None:
    with pytest.raises(SettingsError, match="base_m"):
        cylinder(text, "--cylinder")


@pytest.mark.parametrize("text", ["", "a,,b", "a:1:2:3", "a:0", "a:nan"])
def test_a_column_that_is_none(text: str) -> None:
    with pytest.raises(LogError):
        column_maps(text, "--joystick")


def test_answers_take_the_place_of_flags(place: Path, tmp_path: Path) -> None:
    answers = iter(["yard", "arm 7", "", "", "", "", "extend", "", "maybe not", ""])
    asked: list[str] = []

    def ask(prompt: str) -> str:
        asked.append(prompt)
        return next(answers)

    wishes = Wishes(str(place / "small_arm.urdf"), str(tmp_path))
    console = Console(file=io.StringIO(), width=120)
    assert init(wishes, console, StopFlag(), ask) == 0
    site = load_site(tmp_path / "site.yaml")
    assert (site.name, site.machine) == ("yard", "arm 7")
    assert site.keys.base == "rampe/yard/arm-7/guard"
    assert site.actuator_names == ("turn", "lift", "extend")
    assert asked[0] == "Name of the site [my-site]: "
    assert any("hydraulic cylinder" in prompt for prompt in asked)


def test_a_recording_is_known_by_the_roles_of_its_channels() -> None:
    heard = heard_in_file(str(BENCH_LOG), None, None)
    assert heard.joystick == "rampe/bench/excavator/joystick"
    assert heard.traces.axes.shape[1] == 4
    assert heard.traces.position.shape[1] == 4
    assert 5.0 < heard.seconds < 60.0
    assert heard.refused["joystick: bad_json"] == 1  # somebody sent rubbish
    with pytest.raises(LogError, match="no topic 'a/b' for --joystick; it has rampe/bench"):
        heard_in_file(str(BENCH_LOG), "a/b", None)


def test_messages_that_name_their_actuators() -> None:
    """In any order, and a message that says less is left out and counted."""

    def messages() -> Iterator[tuple[float, bytes]]:
        for k in range(30):
            given = {"b": k, "a": -k} if k % 2 else {"a": -k, "b": k}
            message = {"stamp": k / 10, "name": list(given), "position": list(given.values())}
            yield k / 10 + 0.01, json.dumps(message).encode()
        yield 4.0, b'{"stamp": 4.0, "position": [1.0, 2.0]}'
        yield 4.1, b'{"stamp": 4.1, "position": [1.0]}'
        yield 4.2, b"{"
        yield 4.3, b'{"stamp": 4.3, "position": [1e9, 2.0]}'

    levers = [(k / 10, json.dumps({"stamp": k / 10, "axes": [0.1]}).encode()) for k in range(30)]
    traces, refused = traces_of(levers, messages())
    assert traces.names == ("a", "b")
    assert traces.position[:, 1].tolist() == list(range(30))
    assert traces.time_s[-1] == pytest.approx(2.91)  # on our clock
    assert refused == {
        "actuators: bad_name": 1,
        "actuators: wrong_length": 1,
        "actuators: bad_json": 1,
        "actuators: not_finite": 1,
    }
