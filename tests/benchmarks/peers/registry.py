"""Who takes part, and what each one's "free" is worth."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module, metadata
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.benchmarks.peers.work import Peer, Work

HERE = "tests.benchmarks.peers"
OURS = "rampe-guard"
PROOF = "proof"
DISTANCE = "if its distance is right"
HULLS = "of hulls, if its distance is right"
SAMPLES = "none below 2.5 mm depth"
NONE = "none"


@dataclass(frozen=True, slots=True)
class Entry:
    """One row of the table.

    Attributes:
        key: for the command line.
        name: for the table.
        guarantee: a word.
        module, factory: where its class is.
        package: whose version to name.
        needs_folder: its class takes a folder for files beside the work.
    """

    key: str
    name: str
    guarantee: str
    module: str
    factory: str
    package: str
    needs_folder: bool = False

    def build(self, work: Work, folder: Path) -> Peer:
        """Make it ready.

        Raises:
            ModuleNotFoundError: its package is not installed.
        """
        made = cast("Callable[..., Peer]", getattr(import_module(self.module), self.factory))
        return made(work, folder) if self.needs_folder else made(work)

    @property
    def version(self) -> str:
        """Of its package; "" if that is not installed."""
        try:
            return metadata.version(self.package)
        except metadata.PackageNotFoundError:
            return ""


ENTRIES = (
    Entry("ours", OURS, PROOF, f"{HERE}.ours", "Ours", "rampe-guard"),
    Entry(
        "mujoco-compiled", "MuJoCo mj_geomDistance advancement, loop compiled too", HULLS,
        f"{HERE}.mujoco_peers", "CompiledMujoco", "mujoco",
    ),
    Entry(
        "mujoco", "MuJoCo mj_geomDistance advancement", HULLS, f"{HERE}.mujoco_peers",
        "AdvancingMujoco", "mujoco",
    ),
    Entry(
        "coal", "coal advancement, hulls then meshes", DISTANCE, f"{HERE}.coal_peers",
        "AdvancingCoal", "coal",
    ),
    Entry(
        "tesseract", "Tesseract cast hulls, 0.05 rad", NONE, f"{HERE}.tesseract_peer",
        "CastTesseract", "tesseract-robotics", needs_folder=True,
    ),
    Entry(
        "coal-dense", "coal dense 5 mm, broad phase", SAMPLES, f"{HERE}.coal_peers", "DenseCoal",
        "coal",
    ),
    Entry(
        "fcl-dense", "FCL dense 5 mm, broad phase", SAMPLES, f"{HERE}.dense", "DenseFcl",
        "python-fcl",
    ),
    Entry(
        "trimesh-dense", "trimesh CollisionManager dense 5 mm", SAMPLES, f"{HERE}.dense",
        "DenseTrimesh", "trimesh",
    ),
)  # fmt: skip


def oracle(work: Work, step_m: float) -> tuple[str, Peer]:
    """The densest sampler at hand that is not ours, and its name."""
    try:
        from tests.benchmarks.peers.coal_peers import DenseCoal  # noqa: PLC0415  # may be missing
    except ModuleNotFoundError:
        from tests.benchmarks.peers.dense import DenseFcl  # noqa: PLC0415  # the way out

        return "FCL", DenseFcl(work, step_m)
    return "coal", DenseCoal(work, step_m)
