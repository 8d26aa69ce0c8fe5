"""What `init` leaves behind: a site that can be guarded, or all as it was before."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from rampe_guard.errors import LogError
from rampe_guard.programs.initing_wishes import key_part
from rampe_guard.programs.initing_writing import written
from rampe_guard.programs.measuring import traces_of
from rampe_guard.settings import load_site
from tests.support import small_arm
from tests.support.processes import Process, called

END_S = 15.0
"""Without a look at the signal it would never end; a busy machine takes seconds to let go."""


def _init(folder: Path, out: Path, *more: str) -> tuple[int, str, str]:
    urdf = small_arm.write_urdf(folder)
    done = called("init", urdf, "--out", out, "--yes", *more)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("--site=", "--site '' is no name"),
        ("--machine= x", "--machine ' x' is no name"),
        ("--names=a,a,b", "a is there twice"),
        ("--cylinder=lift=1,2,5", "limits of joint 'lift'"),  # a triangle that cannot close
    ],
)
def test_what_cannot_be_guarded_is_not_written(tmp_path: Path, wrong: str, said: str) -> None:
    out = tmp_path / "site"
    code, _, err = _init(tmp_path, out, wrong)
    assert code == 2
    assert said in err
    assert list(out.glob("*.yaml")) == []
    assert _init(tmp_path, out)[0] == 0  # without --force


def test_what_was_there_comes_back(tmp_path: Path) -> None:
    (tmp_path / "site.yaml").write_text("mine")
    code, _, err = _init(tmp_path, tmp_path, "--force", "--cylinder=lift=1,2,5")
    assert code == 2
    assert "all is as it was before" in err
    assert (tmp_path / "site.yaml").read_text() == "mine"
    assert not (tmp_path / "scene.yaml").exists()


def test_all_keys_are_made_of_the_same_names(tmp_path: Path) -> None:
    assert _init(tmp_path, tmp_path, "--site=**", "--machine=a/b ?")[0] == 0
    keys = load_site(tmp_path / "site.yaml").keys
    base = f"rampe/{key_part('**')}/{key_part('a/b ?')}"
    assert (keys.joystick, keys.actuators) == (f"{base}/joystick", f"{base}/actuators")
    assert keys.base == f"{base}/guard"


def test_the_last_words_are_what_is_to_do(tmp_path: Path) -> None:
    _, out, _ = _init(tmp_path, tmp_path)
    site = (tmp_path / "site.yaml").read_text()
    count = sum("TODO" in line for line in site.splitlines()[2:])
    last = "".join(out[out.rindex("first look at") :].split())  # wherever a line was broken
    assert last == (
        f"first look at {count} lines marked TODO in {tmp_path / 'site.yaml'},"
        f" 1 line marked TODO in {tmp_path / 'scene.yaml'}; nothing was measured"
    ).replace(" ", "")


def test_what_was_heard_live_may_lie_in_the_folder(tmp_path: Path) -> None:
    """A second try measures from what the first has kept."""
    log = small_arm.write_log(tmp_path / "measured.csv", small_arm.ticks(rate_hz=25.0))
    columns = ("--joystick", "a0,a1,a2", "--actuators", "turn,lift,reach")
    code, _, err = _init(tmp_path, tmp_path, "--log", str(log), *columns)
    assert (code, err) == (0, "")


def test_ends_that_no_joint_has_are_none(tmp_path: Path) -> None:
    urdf = small_arm.write_urdf(tmp_path)
    text = urdf.read_text()
    assert 'lower="-2.5" upper="2.5"' in text
    urdf.write_text(text.replace('lower="-2.5" upper="2.5"', 'lower="-1e308" upper="1e308"'))
    done = called("init", urdf, "--out", tmp_path / "site", "--yes")
    assert (done.returncode, done.stderr) == (0, "")
    assert "turn: the URDF tells no ends, or such as no joint has" in done.stdout
    assert "endless" in done.stdout


def test_a_reader_who_has_seen_enough_costs_no_file(tmp_path: Path) -> None:
    site = tmp_path / "site.yaml"
    with pytest.raises(BrokenPipeError), written({site: "good"}):
        raise BrokenPipeError
    assert site.read_text() == "good"
    with pytest.raises(KeyboardInterrupt), written({site: "half"}):
        raise KeyboardInterrupt
    assert site.read_text() == "good"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_while_it_reads(tmp_path: Path, number: signal.Signals) -> None:
    """The log is a pipe into which nobody writes: a file that takes for ever."""
    pipe = tmp_path / "log.csv"
    os.mkfifo(pipe)
    urdf = small_arm.write_urdf(tmp_path)
    where: list[str | Path] = ["--out", tmp_path / "site", "--log", pipe]
    args = ["-m", "rampe_guard", "init", urdf, *where, "--yes"]
    with Process(tmp_path, "init", args) as process:
        writer = _writer(pipe)
        try:
            assert process.signal_and_wait(number) <= END_S
        finally:
            os.close(writer)
        assert process.popen.returncode == 130
        assert process.err == "rampe-guard: stopped before it was done\n"
    assert list((tmp_path / "site").iterdir()) == []


def _writer(pipe: Path) -> int:
    """The other end of a pipe, as soon as somebody reads it."""
    until_s = time.monotonic() + 30.0
    while True:
        try:
            return os.open(pipe, os.O_WRONLY | os.O_NONBLOCK)
        except OSError:
            assert time.monotonic() < until_s
            time.sleep(0.02)


@pytest.mark.parametrize("factor", [1e3, 1e6])
def test_stamps_that_are_no_seconds_are_refused(factor: float) -> None:
    def messages(word: str, scale: float) -> list[tuple[float, bytes]]:
        return [
            (k / 25, b'{"stamp": %r, "%s": [0.1]}' % (k / 25 * scale, word.encode()))
            for k in range(50)
        ]

    traces, _ = traces_of(messages("axes", 1.0), messages("position", 1.0))
    assert len(traces.time_s) == 50
    with pytest.raises(LogError, match=r"actuators: stamps go on by .* is stamp in seconds"):
        traces_of(messages("axes", 1.0), messages("position", factor))
