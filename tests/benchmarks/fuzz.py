"""A million bad messages and ten thousand bad files: ``python -m tests.benchmarks.fuzz``.

    [--messages 1000000] [--files 10000] [--seed 1] [--jobs 2] [--cdr]

Messages go through the daemon's own loop (`tests.support.message_fuzz`, which says what must
hold), files through ``rampe-guard check`` (`tests.support.file_fuzz`), both in processes that may
die. Prints what was fed, how it was refused, what did not hold, and how long things took; the exit
code is 1 if anything did not hold. With ``--cdr`` joystick and actuators are as ROS 2 sends them.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rampe_guard import kernel_cache
from tests.support.gauges import cost
from tests.support.processes import ROOT

HANG_S = 10.0
"""A file may take as long as its geometry takes to build, no longer: of processor time."""
LOST_S = 300.0
"""Without a word for so long it is stuck, whatever it waits for."""
GROWTH_MB = 8.0
"""Between a fifth of the messages and all of them: the caches of a guard at work."""


@dataclass
class Files:
    """What came of the files: outcomes by kind, the longest times [ms], what did not hold."""

    outcomes: Counter[tuple[str, str]] = field(default_factory=Counter)
    slowest_ms: list[tuple[float, int, str]] = field(default_factory=list)
    over_second: int = 0
    wrong: list[str] = field(default_factory=list)

    def note(self, what: str) -> None:
        """Something did not hold."""
        self.wrong.append(what)
        print(what, flush=True)


def start(folder: Path, module: str, *args: object) -> subprocess.Popen[str]:
    """A process with caches of its own, but for the compiled sweep."""
    with (folder / f"{module}.err").open("a") as err:
        return subprocess.Popen(
            [sys.executable, "-m", module, *map(str, args)],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=err,
            text=True,
            env={
                **os.environ,
                "OPENBLAS_NUM_THREADS": "1",
                "RAMPE_GUARD_CACHE": str(folder / "cache"),
                "STATE_DIRECTORY": str(folder / "state"),
            },
        )


def lines_of(process: subprocess.Popen[str]) -> queue.SimpleQueue[str | None]:
    """Its lines as they come, None at its end."""
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    assert process.stdout is not None
    out = process.stdout

    def read() -> None:
        with out:
            for line in out:
                lines.put(line)
        lines.put(None)

    threading.Thread(target=read, daemon=True).start()
    return lines


def end(process: subprocess.Popen[str]) -> int:
    """Its exit code; it is killed if it still runs."""
    with contextlib.suppress(subprocess.TimeoutExpired):
        return process.wait(2.0)
    process.kill()
    return process.wait()


def fuzz_files(folder: Path, seed: int, first: int, last: int, found: Files) -> None:
    """Check files ``first`` to ``last``; behind one that kills or hangs it goes on."""
    folder.mkdir(parents=True)
    while first < last:
        process = start(
            folder, "tests.support.file_fuzz", folder / "site", seed, first, last - first
        )
        lines = lines_of(process)
        limit_s = 60.0  # it has to load
        try:
            while (line := _next_line(process, lines, limit_s)) is not None:
                number, kind, outcome, took_ms = line.split()
                limit_s, first = HANG_S, int(number) + 1
                found.outcomes[kind, outcome] += 1
                found.over_second += float(took_ms) > 1000.0
                found.slowest_ms.append((float(took_ms), int(number), kind))
                found.slowest_ms = sorted(found.slowest_ms, reverse=True)[:5]
                if outcome == "BAD":
                    found.note(f"file {number} ({kind}): see {folder}")
        except TimeoutError:
            process.kill()
            found.note(f"file {first} hung for more than {limit_s:g} s: see {folder}")
            first += 1
        finally:
            code = end(process)
        if code != 0 and first < last and not _told(found, first - 1):
            found.note(f"file {first}: the process died with {code}: see {folder}")
            first += 1


def _next_line(
    process: subprocess.Popen[str], lines: queue.SimpleQueue[str | None], cpu_s: float
) -> str | None:
    """What it says next, None at its end; TimeoutError after so much of its processor time [s]."""
    began_s, used_s = time.monotonic(), _cpu_s(process.pid)
    while True:
        try:
            return lines.get(timeout=1.0)
        except queue.Empty:
            lost = time.monotonic() - began_s > LOST_S
            if lost or _cpu_s(process.pid) - used_s > cpu_s:
                raise TimeoutError from None


def _cpu_s(pid: int) -> float:
    """0 of a process that has ended."""
    try:
        return cost(pid).cpu_s
    except OSError:
        return 0.0


def _told(found: Files, number: int) -> bool:
    return any(f"file {number} hung" in line for line in found.wrong)


def fuzz_messages(
    folder: Path, messages: int, seed: int, encoding: str, found: dict[str, Any]
) -> None:
    """Feed messages; the newest account of it lands in ``found``."""
    folder.mkdir(parents=True)
    process = start(folder, "tests.support.message_fuzz", folder, messages, seed, encoding)
    lines = lines_of(process)
    try:
        while (line := lines.get(timeout=LOST_S)) is not None:
            found.update(json.loads(line))
    except queue.Empty:
        found.setdefault("wrong", []).append("it hung")
    finally:
        process.kill() if process.poll() is None and found.get("messages", 0) < messages else None
        code = end(process)
    if code != 0 or found.get("messages", 0) < messages:
        err = (folder / "tests.support.message_fuzz.err").read_text("utf-8", "replace")[-2000:]
        found.setdefault("wrong", []).append(f"it ended with {code}: {err}")


def together(parts: list[dict[str, Any]]) -> dict[str, Any]:
    """One account of several processes."""
    fed: Counter[str] = Counter()
    refused: Counter[str] = Counter()
    for part in parts:
        fed.update(part.get("fed", {}))
        for name, reasons in part.get("refused", {}).items():
            refused.update({f"{name} {reason}": count for reason, count in reasons.items()})
    growth = [p["memory_mb"][-1] - p["memory_mb"][0] for p in parts if p.get("memory_mb")]
    wrong = [line for part in parts for line in part.get("wrong", [])]
    wrong += [f"memory grew by {mb:.1f} MB" for mb in growth if mb > GROWTH_MB]
    return {
        "messages": sum(part.get("messages", 0) for part in parts),
        "fed": dict(fed),
        "well_formed": sum(sum(part.get("well_formed", {}).values()) for part in parts),
        "left_out_of_strict_stretches": sum(part.get("left_out", 0) for part in parts),
        "refused": dict(refused.most_common()),
        "turns_judged": sum(part.get("judged", 0) for part in parts),
        "of_them_not_monitoring": sum(part.get("lost", 0) for part in parts),
        "scenes_taken": sum(part.get("scenes", 0) for part in parts),
        "slowest_turn_ms": 1e3 * max(part.get("slowest_s", 0.0) for part in parts),
        "memory_growth_mb": growth,
        "wrong": wrong,
    }


def run_all(jobs: list[threading.Thread]) -> float:
    """How long they took together [s]."""
    began_s = time.monotonic()
    for job in jobs:
        job.start()
    for job in jobs:
        job.join()
    return time.monotonic() - began_s


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=1_000_000)
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--cdr", action="store_true", help="joystick and actuators as ROS 2")
    parser.add_argument("--keep", type=Path, help="a folder for what did not hold")
    args = parser.parse_args()
    kernel_cache.choose_folder()
    wrong: list[str] = []
    with contextlib.ExitStack() as stack:
        base = args.keep or Path(
            stack.enter_context(tempfile.TemporaryDirectory(prefix="rampe-guard-"))
        )
        share = range(args.jobs)
        if args.messages:
            parts: list[dict[str, Any]] = [{} for _ in share]
            each = -(-args.messages // args.jobs)
            took_s = run_all(
                [
                    threading.Thread(
                        target=fuzz_messages,
                        args=(
                            base / f"messages-{i}",
                            each,
                            args.seed * 100 + i,
                            "cdr" if args.cdr else "json",
                            parts[i],
                        ),
                    )
                    for i in share
                ]
            )
            account = together(parts)
            wrong += account.pop("wrong")
            rate = account["messages"] / took_s
            print(f"{account['messages']} messages in {took_s:.0f} s, {rate:.0f}/s")
            print(json.dumps(account, indent=1), flush=True)
        if args.files:
            found = [Files() for _ in share]
            ends = [args.files * i // args.jobs for i in range(args.jobs + 1)]
            took_s = run_all(
                [
                    threading.Thread(
                        target=fuzz_files,
                        args=(base / f"files-{i}", args.seed, ends[i], ends[i + 1], found[i]),
                    )
                    for i in share
                ]
            )
            outcomes = sum((f.outcomes for f in found), Counter[tuple[str, str]]())
            print(f"{outcomes.total()} files in {took_s:.0f} s")
            for (kind, outcome), count in sorted(outcomes.items()):
                print(f"  {kind:6} {outcome:8} {count}")
            slowest = sorted((s for f in found for s in f.slowest_ms), reverse=True)[:5]
            print("  slowest [ms], number, kind:", *slowest)
            print(f"  over a second: {sum(f.over_second for f in found)}")
            wrong += [line for f in found for line in f.wrong]
    for line in wrong:
        print("NOT KEPT:", line)
    print("all kept" if not wrong else f"{len(wrong)} not kept")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
