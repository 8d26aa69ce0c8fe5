"""What a site file must hold beyond the shape of its values: names, keys, drives, axes."""

from __future__ import annotations

from collections.abc import Iterable

from rampe_guard.settings import network
from rampe_guard.settings.drive_model import impossible
from rampe_guard.settings.network import PROVEN, protocol, shown
from rampe_guard.settings.problems import KeyPath, Problems, did_you_mean, show
from rampe_guard.settings.published import PUBLISHED
from rampe_guard.settings.ros2_model import check_ros2, speech_of
from rampe_guard.settings.site_model import (
    ArmModel,
    ColumnModel,
    LogModel,
    SiteModel,
    TlsModel,
    ZenohModel,
)

_WILD = "*$?#"


def check(model: SiteModel, problems: Problems) -> None:
    """Add every problem of ``model`` that needs no other file."""
    _keys(model, problems)
    check_ros2(model, problems)
    _zenoh(model, problems)
    if model.alerts.caution_probability > model.alerts.warning_probability:
        warning = model.alerts.warning_probability
        what = f"{model.alerts.caution_probability:g} is greater than warning_probability"
        problems.add(("alerts", "caution_probability"), what, f"give at most its {warning:g}")
    if model.advice.hold_s < 2.0 * model.advice.period_s:
        what = f"{model.advice.hold_s:g} s is less than two periods of period_s"
        problems.add(("advice", "hold_s"), what, f"give {2.0 * model.advice.period_s:g} or more")
    if model.alerts.expires_after_s < 2.0 * model.alerts.republish_s:
        what = f"{model.alerts.expires_after_s:g} s is less than two periods of republish_s"
        problems.add(
            ("alerts", "expires_after_s"), what, "let an alert outlive the loss of one repeat"
        )
    _rampe(model, problems)
    _actuators(model.arm, problems)
    _linkages(model.arm, problems)
    _self_collision(model, problems)
    if model.log is not None:
        _log(model.log, [a.name for a in model.arm.actuators], problems)


def _keys(model: SiteModel, problems: Problems) -> None:
    keys: list[tuple[KeyPath, str]] = [
        *((("keys", name), key) for name, key in speech_of(model).keys.items()),
        (("keys", "base"), model.keys.base),
    ]
    if model.keys.enabled is not None:
        keys.append((("keys", "enabled"), model.keys.enabled))
    alive: KeyPath = ("inputs", "joystick", "alive_key")
    if model.inputs.joystick.alive_key is not None:
        keys.append((alive, model.inputs.joystick.alive_key))
    elif model.inputs.joystick.on_change:
        what = "is missing, and on_change makes the joystick's silence mean nothing"
        problems.add(alive, what, "give the key of the publisher's liveliness token")
    first: dict[str, KeyPath] = {}
    for path, key in keys:
        if wrong := wrong_key(key):
            problems.add(path, f"{show(key)} {wrong}", "give an exact Zenoh key such as a/b/c")
        if key in first:
            other = ".".join(str(part) for part in first[key])
            problems.add(path, f"{show(key)} is also {other}", "give every key its own name")
        first.setdefault(key, path)
        if key in {f"{model.keys.base}/{word}" for word in PUBLISHED}:
            what = f"{show(key)} is a key that the guard itself publishes under keys.base"
            problems.add(path, what, "give another key")


def wrong_key(key: str) -> str | None:
    """Why ``key`` is no exact Zenoh key, None if it is one."""
    wild = [letter for letter in _WILD if letter in key]
    if wild:
        return f"has {show(wild[0])}, which an exact key cannot have"
    if key.startswith("/") or key.endswith("/"):
        return "starts or ends with a slash"
    return "has an empty part (//)" if "//" in key else None


def _zenoh(model: SiteModel, problems: Problems) -> None:
    zenoh = model.zenoh
    if zenoh.tls is not None:
        _tls(zenoh, zenoh.tls, problems)
    if zenoh.config is not None:
        if zenoh.connect is not None:
            what = "stands beside a config file"
            problems.add(("zenoh", "connect"), what, "put the endpoints into that file")
    elif zenoh.connect == ():
        what = "names no endpoint, and scouting is off"
        problems.add(("zenoh", "connect"), what, "give one, such as tcp/127.0.0.1:7447")
    else:
        _endpoints(zenoh, problems)


def _endpoints(zenoh: ZenohModel, problems: Problems) -> None:
    for place, endpoint in enumerate(zenoh.connect or ()):
        where: KeyPath = ("zenoh", "connect", place)
        if reason := network.impossible(endpoint):
            what, remedy = f"{show(shown(endpoint))} {reason}", "give PROTOCOL/HOST:PORT"
            problems.add(where, what, remedy)
        elif (
            protocol(endpoint) in PROVEN
            and zenoh.tls is None
            and not network.brings_authority(endpoint)
        ):
            what = f"{show(shown(endpoint))} is proven by certificates, and there are none"
            problems.add(
                where, what, "add zenoh.tls: {root_ca: FILE, certificate: FILE, key: FILE}"
            )


def _tls(zenoh: ZenohModel, tls: TlsModel, problems: Problems) -> None:
    if (tls.certificate is None) != (tls.key is None):
        given, missing = ("certificate", "key") if tls.key is None else ("key", "certificate")
        what = f"is given without {missing}"
        problems.add(("zenoh", "tls", given), what, "give both, or neither")
    if zenoh.config is not None:
        what = "stands beside a config file"
        problems.add(("zenoh", "tls"), what, "put the certificates into that file")
    elif not any(protocol(end) in PROVEN for end in zenoh.connect or ()):
        what = "is given, and every endpoint is plain"
        if zenoh.connect:
            what += f" ({shown(zenoh.connect[0])})"
        problems.add(("zenoh", "tls"), what, "connect to one such as tls/router.example:7447")


def _rampe(model: SiteModel, problems: Problems) -> None:
    basis, n = model.rampe.basis, len(model.arm.actuators)
    if not isinstance(basis, str) and len(basis) != n:
        what = f"has {len(basis)} entries for {n} actuators"
        problems.add(("rampe", "basis"), what, "give one for all, or one for each in their order")
    seen = model.rampe.observations
    if seen[0] != "q" or len(set(seen)) != len(seen):
        what = f"is {', '.join(seen)}"
        problems.add(("rampe", "observations"), what, "begin with q and name each at most once")


def _actuators(arm: ArmModel, problems: Problems) -> None:
    names: dict[str, int] = {}
    axes: dict[int, str] = {}
    for index, actuator in enumerate(arm.actuators):
        where: KeyPath = ("arm", "actuators", index)
        if actuator.name in names:
            what = f"{show(actuator.name)} is also the name of actuator {names[actuator.name]}"
            problems.add((*where, "name"), what, "give every actuator a name of its own")
        names.setdefault(actuator.name, index)
        axis = index if actuator.axis is None else actuator.axis
        if axis in axes:
            what = f"{axis} is the axis of {show(axes[axis])} already"
            problems.add((*where, "axis"), what, "give every actuator an axis of its own")
        axes.setdefault(axis, actuator.name)
        lower, upper = actuator.limits.lower, actuator.limits.upper
        if lower is not None and upper is not None and lower >= upper:
            what = f"lower {lower:g} is not less than upper {upper:g}"
            problems.add((*where, "limits"), what, "swap or correct them")
        elif reason := impossible(actuator.drive.to_core(), lower, upper):
            problems.add((*where, "drive"), reason, "measure its dimensions and limits again")


def _linkages(arm: ArmModel, problems: Problems) -> None:
    limits = {a.name: (a.limits.lower, a.limits.upper) for a in arm.actuators}
    joints: dict[str, KeyPath] = {}
    moved = [(("arm", "actuators", i, "joint"), a.joint) for i, a in enumerate(arm.actuators)]
    moved += [(("arm", "linkages", i, "joint"), k.joint) for i, k in enumerate(arm.linkages)]
    for path, joint in moved:
        if joint in joints:
            what = f"{show(joint)} is driven twice"
            problems.add(path, what, "let each joint follow one actuator")
        joints.setdefault(joint, path)
    for index, linkage in enumerate(arm.linkages):
        where: KeyPath = ("arm", "linkages", index)
        if linkage.actuator not in limits:
            what = f"{show(linkage.actuator)} is not an actuator"
            problems.add((*where, "actuator"), what, did_you_mean(linkage.actuator, limits))
        elif reason := impossible(linkage.drive.to_core(), *limits[linkage.actuator]):
            problems.add((*where, "drive"), reason, "measure its dimensions again")


def _self_collision(model: SiteModel, problems: Problems) -> None:
    """Pairs of two, each once; whether the arm has such links is only known with its URDF."""
    first: dict[frozenset[str], int] = {}
    for index, pair in enumerate(model.self_collision.allow):
        where: KeyPath = ("self_collision", "allow", index)
        links = frozenset(pair)
        if len(links) == 1:
            what = f"names {show(pair[0])} twice"
            problems.add(where, what, "give the names of two links")
        elif links in first:
            what = f"is the same pair as allow[{first[links]}]"
            problems.add(where, what, "give every pair once, in any order")
        first.setdefault(links, index)


def _log(log: LogModel, names: list[str], problems: Problems) -> None:
    for part, columns in (("joystick", log.joystick), ("actuators", log.actuators)):
        _log_names(("log", part), columns, names, problems)
        for name, column in columns.items():
            if isinstance(column, ColumnModel) and column.scale == 0.0:
                what = "0 makes every value the same"
                problems.add(("log", part, name, "scale"), what, "give the factor to site units")
    if isinstance(log.time, ColumnModel) and log.time.scale <= 0.0:
        what = f"{log.time.scale:g} is not greater than 0"
        problems.add(("log", "time", "scale"), what, "give the factor to seconds")


def _log_names(path: KeyPath, columns: Iterable[str], names: list[str], problems: Problems) -> None:
    given = list(columns)
    for name in given:
        if name not in names:
            what = f"{show(name)} is not an actuator"
            problems.add((*path, name), what, did_you_mean(name, names))
    missing = [name for name in names if name not in given]
    if missing:
        what = f"has no column for {', '.join(missing)}"
        problems.add(path, what, "name a column for every actuator")
