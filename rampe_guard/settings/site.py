"""Site files → `Site`."""

from __future__ import annotations

import hashlib
import os
from dataclasses import replace
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from rampe_guard.core.arm import ArmDescription, JointDrive
from rampe_guard.core.config import (
    ActuatorConfig,
    AdviceConfig,
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
from rampe_guard.core.drive import CylinderDrive, FourBarDrive
from rampe_guard.core.scene import Scene, SelfCollision
from rampe_guard.errors import SettingsError
from rampe_guard.folders import Folders
from rampe_guard.settings.check import check
from rampe_guard.settings.explain import validate
from rampe_guard.settings.model import MAX_NAME, Name
from rampe_guard.settings.problems import KeyPath, Problems, show
from rampe_guard.settings.ros2_model import speech_of
from rampe_guard.settings.scene import existing_file, load_scene, parse_scene, pose_matrix
from rampe_guard.settings.site_model import (
    DEFAULT_ENDPOINT,
    ActuatorModel,
    ColumnModel,
    LogModel,
    MemoryModel,
    SelfCollisionModel,
    SiteModel,
    ZenohModel,
)
from rampe_guard.settings.site_types import (
    ColumnMap,
    Keys,
    LogMapping,
    MemorySettings,
    MetricsSettings,
    Site,
    TlsFiles,
    ZenohSettings,
)
from rampe_guard.settings.source import Document, parse, read_bytes


def load_site(path: str | Path, *, within: str | Path | None = None) -> Site:
    """Read a site file, and the scene file that it names.

    Args:
        path: the YAML file; every path in it is relative to it.
        within: the one folder in which its files must lie, instead of its own and those that it
            allows: for a site file that somebody else may have written, as in a recording.

    Raises:
        SettingsError: with file, line, key, value and remedy of every problem.
    """
    content = read_bytes(path, "site file", "give the path of a site file (config/sites/*.yaml)")
    document = parse(content, str(path))
    model = validate(SiteModel, document)
    directory = Path(path).parent
    folders = Folders.of(within) if within else _folders(model, directory, document)
    problems = Problems(document)
    check(model, problems)
    arm = model.arm
    urdf = existing_file(problems, ("arm", "urdf"), directory, arm.urdf, "URDF file", folders)
    zenoh = _zenoh(model.zenoh, directory, folders, problems)
    names = tuple(a.name for a in arm.actuators)
    speech = speech_of(model)
    alive = model.inputs.joystick.alive_key
    keys = Keys(**{**model.keys.model_dump(), **speech.keys}, joystick_alive=alive)
    scene = Scene(())
    scene_file = existing_file(problems, ("scene",), directory, model.scene, "scene file", folders)
    if scene_file is not None:
        try:
            scene = load_scene(scene_file, actuators=names, taken=keys.used(), folders=folders)
        except SettingsError as error:
            problems.extend(error)
    memory = _memory(model.memory, directory, problems)
    problems.raise_if_any()
    digest = hashlib.sha256(content + read_bytes(urdf or "", "URDF file"))
    return Site(
        name=model.site,
        machine=model.machine,
        zenoh=zenoh,
        keys=keys,
        format=model.format,
        arm=_arm(model, urdf or "", directory, folders),
        guard=_guard(model),
        sweep=SweepConfig(**model.sweep.model_dump()),
        scene=scene,
        log=None if model.log is None else _log(model.log),
        path=str(Path(path).absolute()),
        content_hash=digest.hexdigest(),
        package_dirs=tuple(os.path.normpath(directory / d) for d in arm.package_dirs),
        operator=model.operator,
        memory=memory,
        metrics=None if model.metrics is None else MetricsSettings(**model.metrics.model_dump()),
        self_collision=_self_collision(model.self_collision),
        folders=folders,
        ros2=speech.settings,
    )


def load_scene_text(text: bytes | str, site: Site, name: str = "<scene>") -> Scene:
    """Read a scene that arrived as text, in the place of the site's own.

    The rules of a scene file hold: plain YAML of at most 1 MB, 1000 objects and 24 levels, without
    aliases, anchors or tags; meshes are named relative to the scene file that the site names, and
    lie in the folders that it allows. Meshes are not looked into here.

    Args:
        text: as in a scene file, UTF-8 when bytes.
        site: as `load_site` returned it.
        name: what messages call the text.

    Raises:
        SettingsError: with line, key, value and remedy of every problem.
    """
    scene = parse_scene(
        text,
        actuators=site.actuator_names,
        taken=site.keys.used(),
        directory=Path(site.scene.path or site.path).parent,
        name=name,
        folders=site.folders,
    )
    return replace(scene, path=site.scene.path)


def for_operator(site: Site, name: str | None) -> Site:
    """The same site with another operator at the levers; unchanged if ``name`` is None.

    Raises:
        SettingsError: ``name`` is none.
    """
    if name is None:
        return site
    try:
        TypeAdapter(Name).validate_python(name, strict=True)
    except ValidationError:
        raise SettingsError(
            f"operator {show(name)} is no name; give 1 to {MAX_NAME} printable characters"
            " without spaces at an end"
        ) from None
    return replace(site, operator=name)


def _folders(model: SiteModel, directory: Path, document: Document) -> Folders:
    try:
        return Folders.of(directory, model.files.allow)
    except (OSError, ValueError, RuntimeError) as error:  # a loop of links
        problems = Problems(document)
        reason = getattr(error, "strerror", None) or error
        problems.add(("files", "allow"), f"cannot be followed ({reason})", "give other folders")
        problems.raise_if_any()
        raise


def _memory(model: MemoryModel, directory: Path, problems: Problems) -> MemorySettings:
    folder = None
    if model.directory is not None:
        try:
            folder = str((directory / Path(model.directory).expanduser()).absolute())
        except RuntimeError:  # ~name of nobody
            what = f"{show(model.directory)} begins with a home that does not exist"
            problems.add(("memory", "directory"), what, "give the path of a folder")
    return MemorySettings(model.enabled, folder, model.save_every_s)


def _self_collision(model: SelfCollisionModel) -> SelfCollision:
    pairs = tuple((first, second) for first, second in model.allow)
    return SelfCollision(model.enabled, model.margin_m, pairs)


def _zenoh(
    model: ZenohModel, directory: Path, folders: Folders, problems: Problems
) -> ZenohSettings:
    def existing(where: KeyPath, file: str | None, what: str) -> str | None:
        if file is None:
            return None
        return existing_file(problems, ("zenoh", *where), directory, file, what, folders)

    config = existing(("config",), model.config, "Zenoh configuration file")
    tls = None
    if model.tls is not None:
        root = existing(("tls", "root_ca"), model.tls.root_ca, "certificate (PEM)")
        root_at, certificate_at, key_at = (
            problems.where(("zenoh", "tls", name)) for name in ("root_ca", "certificate", "key")
        )
        certificate = existing(("tls", "certificate"), model.tls.certificate, "certificate (PEM)")
        key = existing(("tls", "key"), model.tls.key, "private key (PEM)")
        tls = TlsFiles(root or "", certificate, key, (root_at, certificate_at, key_at))
    connect = model.connect
    if connect is None:
        connect = () if config else (DEFAULT_ENDPOINT,)
    return ZenohSettings(config, model.mode, connect, tls, model.plain_network is not None)


def _arm(model: SiteModel, urdf: str, directory: Path, folders: Folders) -> ArmDescription:
    arm = model.arm
    index = {a.name: i for i, a in enumerate(arm.actuators)}
    own = [JointDrive(a.joint, i, a.drive.to_core()) for i, a in enumerate(arm.actuators)]
    more = [JointDrive(k.joint, index[k.actuator], k.drive.to_core()) for k in arm.linkages]
    limits = tuple((a.limits.lower, a.limits.upper) for a in arm.actuators)
    pose = pose_matrix(arm.base_pose)
    packages = tuple(os.path.normpath(directory / d) for d in arm.package_dirs)
    return ArmDescription(urdf, pose, (*own, *more), limits, folders.paths, packages)


def _guard(model: SiteModel) -> GuardConfig:
    actuators = tuple(_actuator(a, i) for i, a in enumerate(model.arm.actuators))
    inputs = model.inputs
    rampe = model.rampe.model_dump(exclude={"prior"})
    return GuardConfig(
        actuators=actuators,
        joystick=JoystickConfig(**model.joystick.model_dump()),
        rampe=RampeConfig(**rampe, prior=PriorConfig(**model.rampe.prior.model_dump())),
        stopping=StoppingConfig(**model.stopping.model_dump()),
        next=NextConfig(**model.next.model_dump()),
        advice=AdviceConfig(**model.advice.model_dump()),
        alerts=AlertConfig(**model.alerts.model_dump()),
        inputs=InputConfig(
            joystick_timeout_s=inputs.joystick.timeout_s,
            actuators_timeout_s=inputs.actuators.timeout_s,
            joystick_on_change=inputs.joystick.on_change,
            position_slack=inputs.position_slack,
            speed_slack=inputs.speed_slack,
            max_stamp_jump_s=inputs.max_stamp_jump_s,
            max_clock_loss=inputs.max_clock_loss,
            enabled_timeout_s=None if model.keys.enabled is None else inputs.enabled.timeout_s,
            max_rate_hz=inputs.max_rate_hz,
        ),
        axes=max(a.axis for a in actuators) + 1,
    )


def _actuator(model: ActuatorModel, index: int) -> ActuatorConfig:
    hydraulic = isinstance(model.drive.to_core(), CylinderDrive | FourBarDrive)
    return ActuatorConfig(
        name=model.name,
        axis=index if model.axis is None else model.axis,
        sign=model.sign,
        max_velocity=model.max_velocity,
        max_deceleration=model.max_deceleration or 2.0 * model.max_velocity,
        lag_s=model.lag_s,
        deadband=model.deadband,
        unit=model.unit or ("m" if hydraulic else "rad"),
    )


def _log(model: LogModel) -> LogMapping:
    return LogMapping(
        time=_column(model.time),
        joystick={name: _column(column) for name, column in model.joystick.items()},
        actuators={name: _column(column) for name, column in model.actuators.items()},
    )


def _column(value: str | ColumnModel) -> ColumnMap:
    return ColumnMap(value) if isinstance(value, str) else ColumnMap(**value.model_dump())
