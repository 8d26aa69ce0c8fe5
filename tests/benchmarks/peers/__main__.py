"""The sweep and its peers on the same work: ``python -m tests.benchmarks.peers``.

Run it from the project's root with what ``tests/benchmarks/peers-requirements.txt`` names
installed; peers that are not are left out with a word. All run in this process on one core, warm,
in turns, each motion at the best of up to seven passes, and are judged by exact meshes sampled
every millimetre. ``--scaling`` and ``--any-path`` are about ours alone.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.benchmarks.peers.clock import race, row_of, truth_of
from tests.benchmarks.peers.judge import STEP_M, Judge
from tests.benchmarks.peers.registry import ENTRIES, Entry, oracle
from tests.benchmarks.peers.report import Section, machine_line, machine_record
from tests.benchmarks.peers.scaling import HEAD, any_path, mesh_scaling, object_scaling, records
from tests.benchmarks.peers.scenes import KINDS, build_work
from tests.benchmarks.peers.work import excavator, foreign_machine

if TYPE_CHECKING:
    from tests.benchmarks.peers.work import Machine, Peer, Work

UR5 = "ur5_robot.urdf"


def main() -> int:
    """All works that the options name."""
    options = _options()
    core = options.core if options.core is not None else max(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {core})
    record: dict[str, Any] = {"machine": machine_record(core)}
    print(machine_line(record["machine"]), "\n", flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        machines = _machines(options)
        if not (options.scaling or options.any_path) or options.peers:
            record["works"] = _compare(machines, options, folder)
        if options.scaling:
            record["scaling"] = _scaling(machines, options, folder)
        if options.any_path:
            record["any_path"] = _any_path(machines, options, folder)
    if options.json is not None:
        options.json.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return 0


def _compare(machines: list[Machine], options: argparse.Namespace, folder: Path) -> list[Any]:
    sections = []
    for machine in machines:
        for kind in options.kinds:
            for count in options.objects:
                place = Path(tempfile.mkdtemp(dir=folder))
                work = build_work(machine, count, kind, options.segments, options.seed, place)
                section = run(work, options.peers or [entry.key for entry in ENTRIES], place)
                print(section.markdown(), "\n", flush=True)
                sections.append(section.record())
    return sections


def run(work: Work, keys: list[str], folder: Path) -> Section:
    """Everybody named on one work."""
    judge = Judge(work)
    _, sampler = oracle(work, STEP_M)
    truth = truth_of(work, judge, sampler)
    section = Section.of(work, sum(contact is not None for contact in truth.contacts))
    ready: list[tuple[Entry, Peer]] = []
    for entry in ENTRIES:
        if entry.key not in keys:
            continue
        try:
            ready.append((entry, entry.build(work, folder)))
        except ModuleNotFoundError as error:
            section.skipped.append(f"{entry.name}: skipped, {error.name} is not installed.")
    timed = race([peer for _, peer in ready], len(work.motions))
    for (entry, _), found in zip(ready, timed, strict=True):
        section.rows.append(row_of(entry, work, judge, truth, found))
    return section


def _scaling(machines: list[Machine], options: argparse.Namespace, folder: Path) -> list[Any]:
    print(HEAD)
    rows = []
    for machine in machines:
        for grown in (
            object_scaling(machine, (10, 100, 1000), options.segments, options.seed, folder),
            mesh_scaling(machine, options.segments, options.seed, folder),
        ):
            print("\n".join(row.line() for row in grown), flush=True)
            rows += records(grown)
    print()
    return rows


def _any_path(machines: list[Machine], options: argparse.Namespace, folder: Path) -> list[Any]:
    found = []
    for machine in machines:
        row = any_path(machine, options.segments, options.seed, folder)
        print(
            f"any path, {row['arm']}, three actuators, 100 objects: {row['median_ms']:.2f} /"
            f" {row['p99_ms']:.2f} ms (median / p99), {row['answers']}",
            flush=True,
        )
        found.append(row)
    return found


def _machines(options: argparse.Namespace) -> list[Machine]:
    machines = []
    if "arm" in options.arms:
        urdf = options.urdf or _ur5()
        if urdf is None:
            print("no arm: example-robot-data is not installed, and no --urdf was given\n")
        else:
            machines += [foreign_machine(urdf, 1e-3 * mm) for mm in options.tolerance_mm]
    if "excavator" in options.arms:
        machines.append(excavator(1e-3 * options.excavator_tolerance_mm))
    return machines


def _ur5() -> Path | None:
    try:
        files = metadata.files("example-robot-data") or []
    except metadata.PackageNotFoundError:
        return None
    return next((Path(str(file.locate())) for file in files if file.name == UR5), None)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.peers", description=__doc__)
    add = parser.add_argument
    add("--urdf", type=Path, help="an arm instead of the UR5 of example-robot-data")
    add("--arms", nargs="+", choices=("arm", "excavator"), default=["arm", "excavator"])
    add("--segments", type=int, default=100, help="random motions of each work")
    add("--objects", type=int, nargs="+", default=[6, 100, 1000])
    add("--kinds", nargs="+", choices=KINDS, default=["mixed"])
    add("--tolerance-mm", type=float, nargs="+", default=[1.0], help="of the arm")
    add("--excavator-tolerance-mm", type=float, default=10.0)
    add("--peers", nargs="+", choices=[entry.key for entry in ENTRIES], help="all unless given")
    add("--scaling", action="store_true", help="ours by objects and triangles; no peers")
    add("--any-path", action="store_true", help="ours over every monotone path; no peers")
    add("--seed", type=int, default=0)
    add("--core", type=int, help="the processor core to run on; the last one unless given")
    add("--json", type=Path, help="write all figures to this file")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
