"""Site files: what is read, what is assumed, and how every mistake is reported."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rampe_guard.core.config import (
    AlertConfig,
    GuardConfig,
    InputConfig,
    JoystickConfig,
    NextConfig,
    PriorConfig,
    RampeConfig,
    StoppingConfig,
    SweepConfig,
)
from rampe_guard.core.drive import CylinderDrive, DirectDrive, FourBarDrive, TableDrive
from rampe_guard.core.scene import ActuatorLimit
from rampe_guard.errors import SettingsError
from rampe_guard.settings import ColumnMap, MemorySettings, Site, for_operator, load_site
from rampe_guard.settings import tuning_model as models

SITE = """\
site: quarry-north
machine: excavator-7
keys:
  joystick: rampe/q/e/joystick
  actuators: rampe/q/e/actuators
  base: rampe/q/e/guard
arm:
  urdf: arm.urdf
  actuators:
    - {name: swing, joint: swing_joint, max_velocity: 0.6}
    - name: boom
      joint: boom_joint
      max_velocity: 0.15
      limits: {lower: 0, upper: 0.8}
      drive: {type: cylinder, base_m: 1.5, rod_m: 2.1, length_at_zero_m: 1.3}
scene: scene.yaml
"""
SCENE = "objects:\n  - {name: road, type: actuator_limit, actuator: swing, above: 1.2}\n"

Load = Callable[[str], Site]


@pytest.fixture
def load(tmp_path: Path) -> Load:
    """Writes a site file beside a URDF and a scene, and loads it."""
    (tmp_path / "arm.urdf").write_text("<robot name='arm'/>", encoding="utf-8")
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")

    def write_and_load(text: str) -> Site:
        (tmp_path / "site.yaml").write_text(text, encoding="utf-8")
        return load_site(tmp_path / "site.yaml")

    return write_and_load


def refusal(load: Load, text: str) -> str:
    with pytest.raises(SettingsError) as caught:
        load(text)
    return str(caught.value)


def test_only_five_keys_are_required_and_the_rest_defaults(load: Load, tmp_path: Path) -> None:
    site = load(SITE)
    assert (site.name, site.machine, site.format) == ("quarry-north", "excavator-7", "json")
    assert site.zenoh.connect == ("tcp/127.0.0.1:7447",)
    assert (site.zenoh.mode, site.zenoh.config, site.log) == ("client", None, None)
    assert site.keys.base == "rampe/q/e/guard"
    assert (site.keys.joystick_alive, site.keys.enabled) == (None, None)
    swing, boom = site.guard.actuators
    assert (swing.axis, swing.sign, swing.unit, swing.max_deceleration) == (0, 1, "rad", 1.2)
    assert (swing.lag_s, swing.deadband) == (0.15, 0.05)
    assert (boom.axis, boom.unit, boom.max_deceleration) == (1, "m", 0.3)
    assert site.guard == GuardConfig(actuators=(swing, boom), axes=2)
    assert site.sweep == SweepConfig()
    assert site.scene.objects == (ActuatorLimit(name="road", actuator=0, above=1.2),)
    assert site.arm.joints[0].drive == DirectDrive()
    assert site.arm.joints[1].drive == CylinderDrive(1.5, 2.1, 1.3)
    assert site.arm.limits == ((None, None), (0.0, 0.8))
    assert np.array_equal(site.arm.base_pose, np.eye(4))
    assert site.arm.urdf == str(tmp_path / "arm.urdf")
    assert site.path == str(tmp_path / "site.yaml")
    assert site.actuator_names == ("swing", "boom")
    assert (site.operator, site.memory) == ("operator", MemorySettings())


def test_hash_covers_site_file_and_urdf(load: Load) -> None:
    expected = hashlib.sha256(SITE.encode() + b"<robot name='arm'/>").hexdigest()
    assert load(SITE).content_hash == expected


def test_everything_can_be_set(load: Load, tmp_path: Path) -> None:
    (tmp_path / "zenoh.json5").write_text("{}", encoding="utf-8")
    text = SITE.replace(
        "scene: scene.yaml",
        """\
    - {name: bucket, joint: bucket_joint, axis: 5, sign: -1, unit: rad, max_velocity: 1,
       max_deceleration: 3, lag_s: 0.1, deadband: 0.02,
       drive: {type: four_bar, base_m: 1, rod_m: 1, length_at_zero_m: 1, rocker_offset_rad: 3,
               ground_m: 1, rocker_m: 1, coupler_m: 1, follower_m: 1, direction: -1}}
    - {name: thumb, joint: thumb_joint, max_velocity: 1,
       drive: {type: table, actuator: [0, 1, 2], joint: [3, 2, 0]}}
  linkages:
    - {joint: barrel, actuator: boom,
       drive: {type: cylinder, base_m: 1.5, rod_m: 2.1, length_at_zero_m: 1.3, corner: base}}
  base_pose: {xyz: [1, 2, 3], rpy: [0, 0, 1.5707963267948966]}
  package_dirs: [meshes]
zenoh: {config: zenoh.json5}
format: ros2
inputs:
  joystick: {timeout_s: 1, on_change: true, alive_key: rampe/q/e/stick}
  actuators: {timeout_s: 0.2}
  speed_slack: 2
joystick: {filter_s: 0.1, release_ratio: 0.5, debounce_s: 0}
rampe: {n_init: 4, forgetting: 0.99, prior: {spread: 0.2}, observations: [q]}
operator: Anna Müller
memory: {enabled: false, directory: ../models, save_every_s: 5}
stopping: {reaction_s: 0.5}
sweep: {tolerance_m: 1e-3, max_queries: 100}
next: {horizon_s: 3, analogues: 16, situations: 50000}
alerts: {warning_probability: 0.6, imminent_probability: 0.4, debounce_steps: 3}
log: {time: {column: ms, scale: 0.001}, joystick: {swing: a, boom: b, bucket: c, thumb: d},
      actuators: {swing: e, boom: {column: cm, scale: 0.01, offset: -1}, bucket: f, thumb: g}}
scene: scene.yaml""",
    )
    site = load(text)
    guard = site.guard
    assert guard.axes == 6
    assert guard.actuators[2].sign == -1
    assert guard.actuators[2].unit == "rad"
    assert isinstance(site.arm.joints[2].drive, FourBarDrive)
    assert site.arm.joints[3].drive == TableDrive((0, 1, 2), (3, 2, 0))
    assert site.arm.joints[4].joint == "barrel"
    assert site.arm.joints[4].actuator == 1
    assert site.arm.base_pose @ [1, 0, 0, 1] == pytest.approx([1, 3, 3, 1])
    assert site.package_dirs == (str(tmp_path / "meshes"),)
    assert site.zenoh.config == str(tmp_path / "zenoh.json5")
    assert site.zenoh.connect == ()
    assert site.keys.joystick_alive == "rampe/q/e/stick"
    assert guard.inputs == InputConfig(1, 0.2, joystick_on_change=True, speed_slack=2)
    assert guard.joystick == JoystickConfig(0.1, 0.5, 0)
    prior = PriorConfig(spread=0.2)
    assert guard.rampe == RampeConfig(n_init=4, forgetting=0.99, prior=prior)
    assert guard.stopping == StoppingConfig(0.5)
    assert site.sweep == SweepConfig(tolerance_m=1e-3, max_queries=100)
    assert guard.next == NextConfig(horizon_s=3.0, analogues=16, situations=50_000)
    assert guard.alerts == AlertConfig(
        warning_probability=0.6, imminent_probability=0.4, debounce_steps=3
    )
    assert site.log is not None
    assert site.log.time == ColumnMap("ms", 0.001)
    assert site.log.actuators["boom"] == ColumnMap("cm", 0.01, -1)
    assert site.log.joystick["swing"] == ColumnMap("a")
    assert site.operator == "Anna Müller"
    models_dir = str(tmp_path / ".." / "models")
    assert site.memory == MemorySettings(enabled=False, directory=models_dir, save_every_s=5)


@pytest.mark.parametrize(
    ("model", "config"),
    [
        (models.JoystickModel, JoystickConfig),
        (models.PriorModel, PriorConfig),
        (models.RampeModel, RampeConfig),
        (models.StoppingModel, StoppingConfig),
        (models.SweepModel, SweepConfig),
        (models.AlertsModel, AlertConfig),
    ],
)
def test_every_field_of_the_core_can_be_set(model: type, config: type) -> None:
    fields = [field.name for field in dataclasses.fields(config)]
    assert sorted(model.model_fields) == sorted(fields)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            "max_velocity: 0.15",
            "max_velocity: -0.15",
            (
                "site.yaml:13: arm.actuators[1].max_velocity: -0.15 is not greater than 0; "
                "give the top speed [unit/s]"
            ),
        ),
        (
            "max_velocity: 0.15",
            "max_velocty: 0.15",
            (
                "site.yaml:13: arm.actuators[1].max_velocty: is not a known key; "
                "did you mean 'max_velocity'?"
            ),
        ),
        (
            "      max_velocity: 0.15\n",
            "",
            "site.yaml:11: arm.actuators[1].max_velocity: is missing; give the top speed",
        ),
        (
            "type: cylinder",
            "type: cylindr",
            (
                "site.yaml:15: arm.actuators[1].drive.type: 'cylindr' is not known; "
                "did you mean 'cylinder'?"
            ),
        ),
        ("type: cylinder, ", "", "drive.type: is missing; give one of direct, cylinder"),
        ("rod_m: 2.1", "rod_m: '2.1'", "drive.rod_m: '2.1' is not a number; give the distance"),
        ("rod_m: 2.1", "rod_m: .nan", "drive.rod_m: nan is not a finite number"),
        ("rod_m: 2.1", "rod_m: 1e999", "drive.rod_m: inf is not a finite number"),
        ("rod_m: 2.1", "rod_m: true", "drive.rod_m: true is not a number"),
        ("lower: 0,", "lower: 0.9,", "limits: lower 0.9 is not less than upper 0.8"),
        ("upper: 0.8", "upper: 2.8", "at the upper limit 2.8 the cylinder is 4.1 m long"),
        ("name: boom", "name: swing", "arm.actuators[1].name: 'swing' is also the name of"),
        ("name: boom", "name: boom\n      axis: 0", "actuators[1].axis: 0 is the axis of 'swing'"),
        ("name: boom", "name: boom\n      axis: 64", "axis: 64 is greater than 63"),
        ("name: boom", "name: boom\n      sign: 0", "arm.actuators[1].sign: 0 is not -1 or 1"),
        ("name: boom", 'name: "a\\nb"', "has control characters or spaces at an end"),
        ("joint: boom_joint", "joint: swing_joint", "'swing_joint' is driven twice"),
        ("q/e/joystick", "q/*/joystick", "keys.joystick: 'rampe/q/*/joystick' has '*'"),
        ("q/e/joystick", "q/e/joystick/", "starts or ends with a slash"),
        ("q/e/joystick", "q//joystick", "has an empty part (//)"),
        ("q/e/joystick", "q/e/actuators", "is also keys.joystick; give every key its own name"),
        ("q/e/guard", "q/e/guard\n  enabled: rampe/q/e/guard/shelve", "that the guard itself"),
        ("q/e/guard", "q/e/guard\n  enabled: rampe/*/e/on", "keys.enabled: 'rampe/*/e/on' has '*'"),
        ("q/e/joystick", "q/e/guard/alert", "is a key that the guard itself publishes"),
        ("arm.urdf", "leg.urdf", "site.yaml:8: arm.urdf: 'leg.urdf' does not exist"),
        ("arm.urdf", ".", "arm.urdf: '.' is a directory; give the path of a URDF file"),
        ("scene.yaml", "none.yaml", "site.yaml:16: scene: 'none.yaml' does not exist"),
        ("site: quarry-north", "site:", "site.yaml:1: site: nothing is not text"),
        ("site: quarry-north\n", "", "site.yaml:1: site: is missing; give the name of the site"),
    ],
)
def test_mistake_is_named_with_line_key_value_and_remedy(
    load: Load, old: str, new: str, expected: str
) -> None:
    assert old in SITE
    assert expected in refusal(load, SITE.replace(old, new, 1))


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        ("inputs: {joystick: {on_change: true}}", "alive_key: is missing, and on_change makes"),
        ("zenoh: {connect: []}", "zenoh.connect: names no endpoint"),
        ("zenoh: {connect: [localhost]}", "zenoh.connect[0]: 'localhost' has not the form"),
        ("zenoh: {config: none.json5}", "zenoh.config: 'none.json5' does not exist"),
        (
            "zenoh: {config: scene.yaml, connect: [tcp/a:1]}",
            "connect: stands beside a config file; put the endpoints into that file",
        ),
        ("format: xml", "format: 'xml' is not 'json' or 'ros2'"),
        ("rampe: {n_init: 2.5}", "rampe.n_init: 2.5 is not a whole number"),
        ("rampe: {observations: []}", "rampe.observations: a list of 0 is too short: at least 1"),
        ('operator: "a "', "operator: 'a ' has control characters or spaces at an end"),
        ("memory: {save_every_s: 0}", "memory.save_every_s: 0 is less than 0.1; give the period"),
        ("memory: {enabled: 1}", "memory.enabled: 1 is not true or false"),
        ("memory: {direktory: a}", "memory.direktory: is not a known key; did you mean 'dir"),
        ("memory: {directory: ~nobody-here/a}", "begins with a home that does not exist"),
        ("stopping:", "stopping: nothing is not a mapping"),
        ("alerts: {caution_probability: 0.9}", "0.9 is greater than warning_probability"),
        ("alerts: {warning_probability: 0.05}", "0.1 is greater than warning_probability; give at"),
        ("alerts: {imminent_probability: 1}", "alerts.imminent_probability: 1 is not less than 1"),
        ("next: {horizon_s: 5}", "next.horizon_s: 5 is greater than 4"),
        ("next: {analogues: 33}", "next.analogues: 33 is greater than 32"),
        ("next: {situations: 9999}", "next.situations: 9999 is less than 10000"),
        ("alerts: {republish_s: 0.6}", "expires_after_s: 1 s is less than two periods of republ"),
        ("alerts: {shelve_max_s: 31}", "alerts.shelve_max_s: 31 is greater than 30"),
        ("log: {time: t, joystick: {}, actuators: {}}", "has no column for swing, boom"),
        (
            "log: {time: t, joystick: {swing: a, bom: b}, actuators: {swing: a, boom: b}}",
            "log.joystick.bom: 'bom' is not an actuator; did you mean 'boom'?",
        ),
        ("log: {time: {colum: t}, joystick: {}, actuators: {}}", "log.time.column: is missing"),
        ("log: {time: [t], joystick: {}, actuators: {}}", "log.time: a list of 1 is not text"),
        (
            (
                "log: {time: t, joystick: {swing: {column: a, scale: 0}, boom: b},"
                " actuators: {swing: a, boom: b}}"
            ),
            "log.joystick.swing.scale: 0 makes every value the same",
        ),
        (
            "log: {time: {column: t, scale: 0}, joystick: {}, actuators: {}}",
            "log.time.scale: 0 is not greater than 0",
        ),
    ],
)
def test_mistake_in_an_optional_block(load: Load, block: str, expected: str) -> None:
    text = refusal(load, SITE + block + "\n")
    assert expected in text
    assert "site.yaml:17: " in text


@pytest.mark.parametrize(
    ("drive", "expected"),
    [
        ("{type: direct, scale: 0}", "scale 0 never moves the joint"),
        ("{type: table, actuator: [0, 1], joint: [0]}", "joint: a list of 1 is too short"),
        ("{type: table, actuator: [0, 1], joint: [0, 1, 2]}", "2 actuator values but 3 joint"),
        ("{type: table, actuator: [0, 1, 1], joint: [0, 1, 2]}", "the actuator values neither"),
        ("{type: table, actuator: [0, 1], joint: [2, 2]}", "the joint values neither rise nor"),
        ("{type: table, actuator: [0, 0.5], joint: [0, 1]}", "limit 0.8 is outside its points"),
        (
            (
                "{type: four_bar, base_m: 1.5, rod_m: 2.1, length_at_zero_m: 1.3,"
                " rocker_offset_rad: 0, ground_m: 9, rocker_m: 1, coupler_m: 1, follower_m: 1}"
            ),
            "its longest bar, 9 m, is not shorter than the other three together",
        ),
    ],
)
def test_impossible_drive_is_refused(load: Load, drive: str, expected: str) -> None:
    start = SITE.index("{type: cylinder")
    end = SITE.index("}", start) + 1
    assert expected in refusal(load, SITE[:start] + drive + SITE[end:])


def test_unknown_actuator_of_a_linkage(load: Load) -> None:
    text = SITE.replace("scene:", "  linkages:\n    - {joint: a, actuator: bom}\nscene:")
    assert "arm.linkages[0].actuator: 'bom' is not an actuator; did you mean 'boom'?" in refusal(
        load, text
    )


def test_impossible_drive_of_a_linkage(load: Load) -> None:
    drive = "{type: cylinder, base_m: 1, rod_m: 0.1, length_at_zero_m: 1}"
    linkage = f"  linkages:\n    - {{joint: a, actuator: boom, drive: {drive}}}\nscene:"
    text = refusal(load, SITE.replace("scene:", linkage))
    assert "arm.linkages[0].drive: at the upper limit 0.8 the cylinder is 1.8 m long" in text


def test_all_problems_of_site_and_scene_come_at_once(load: Load, tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("objects: []\n", encoding="utf-8")
    bad = SITE.replace("rampe/q/e/joystick", "a*").replace("arm.urdf", "leg.urdf")
    text = refusal(load, bad).replace(f"{tmp_path}/", "")
    assert [line.split("; ")[0] for line in text.splitlines()] == [
        "site.yaml:4: keys.joystick: 'a*' has '*', which an exact key cannot have",
        "site.yaml:8: arm.urdf: 'leg.urdf' does not exist",
        "scene.yaml:1: objects: a list of 0 is too short: at least 1",
    ]


def test_a_flood_of_problems_is_cut_short(load: Load) -> None:
    text = refusal(load, SITE + "".join(f"extra{i}: 1\n" for i in range(30)))
    assert len(text.splitlines()) == 11
    assert text.endswith("and 20 more")


def test_values_that_are_no_mapping_at_the_top(load: Load) -> None:
    assert "site.yaml:1: is empty; give a mapping with the keys site, machine" in refusal(load, "")
    assert "site.yaml:1: holds a list of 1" in refusal(load, "- a\n")


def test_missing_file_directory_and_odd_paths(tmp_path: Path) -> None:
    for path, expected in (
        (tmp_path / "none.yaml", "there is no such site file"),
        (tmp_path, "is a directory; give a site file"),
        ("a\0b", "cannot be read"),
        ("\ud800", "cannot be read"),
        ("/dev/zero", "is not a regular file"),
    ):
        with pytest.raises(SettingsError, match=expected):
            load_site(path)


def test_the_folder_of_models_may_be_absolute_or_in_a_home(
    load: Load, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home/anna")
    for given, expected in (("/var/models", "/var/models"), ("~/models", "/home/anna/models")):
        assert load(SITE + f"memory: {{directory: {given}}}\n").memory.directory == expected


def test_only_a_machine_with_a_key_for_it_can_be_off(load: Load) -> None:
    assert load(SITE).guard.inputs.enabled_timeout_s is None
    keyed = SITE.replace("/guard\n", "/guard\n  enabled: rampe/q/e/on\n")
    assert load(keyed).keys.enabled == "rampe/q/e/on"
    assert load(keyed).guard.inputs.enabled_timeout_s == 2.0
    slow = load(keyed + "inputs: {enabled: {timeout_s: 5}}\n")
    assert slow.guard.inputs.enabled_timeout_s == 5.0


def test_another_operator_for_one_run(load: Load) -> None:
    site = load(SITE)
    assert for_operator(site, None) is site
    assert for_operator(site, "Ben").operator == "Ben"
    for bad in ("", "a ", "a\nb", "x" * 65, "\udcff"):
        with pytest.raises(SettingsError, match="is no name; give 1 to 64"):
            for_operator(site, bad)
