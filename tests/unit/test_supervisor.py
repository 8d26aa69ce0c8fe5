"""The supervisor with tiny guards: what is started anew, what is not, and who ends with whom."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from rampe_guard.runtime.life import GUARD_NAME, SPARE_NAME
from tests.support.processes import Process, children, living_pid, until

SUPERVISE = """
import signal, sys
from rampe_guard.runtime.supervisor import Supervisor
command = [sys.executable, "-c", sys.argv[1], *sys.argv[2:]]
sys.exit(Supervisor(command, first_delay_s=0.05, longest_delay_s=0.15, look_s=0.1).run())
"""
COUNT = """
import os, pathlib, signal, sys, time
from rampe_guard.runtime.life import restarted_after
from rampe_guard.runtime.supervisor import end_with_parent
folder = pathlib.Path(sys.argv[1])
life = len(list(folder.glob("life-*")))
(folder / f"life-{life}").write_text(f"{os.getpid()} {restarted_after()}")
"""
LIVE = """
signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
end_with_parent()
(folder / "ready").touch()
while True:
    time.sleep(0.01)
"""


def supervise(folder: Path, guard: str) -> Process:
    return Process(folder, "supervisor", ["-c", SUPERVISE, COUNT + guard, folder])


def lives(folder: Path) -> list[str]:
    """After what each guard was started, in order."""
    count = len(list(folder.glob("life-*")))
    return [(folder / f"life-{k}").read_text().partition(" ")[2] for k in range(count)]


def ready(folder: Path) -> None:
    until((folder / "ready").exists, 20.0, "a guard that is ready")


@pytest.mark.parametrize("code", [0, 2, 130])
def test_what_ends_on_purpose_ends_both(tmp_path: Path, code: int) -> None:
    with supervise(tmp_path, f"sys.exit({code})") as parent:
        assert parent.popen.wait(20.0) == code
        assert parent.err == ""
    assert lives(tmp_path) == ["None"]


def test_what_dies_is_started_anew_and_told_why(tmp_path: Path) -> None:
    guard = """
if life == 0: os.kill(os.getpid(), signal.SIGSEGV)
if life == 1: sys.exit(3)
if life == 2: sys.exit(1)
if life == 3: os.kill(os.getpid(), signal.SIGRTMIN + 3)
sys.exit(2)
"""
    with supervise(tmp_path, guard) as parent:
        assert parent.popen.wait(20.0) == 2
        lines = parent.err.splitlines()
    number = signal.SIGRTMIN + 3
    assert lives(tmp_path) == [
        "None",
        "a crash (SIGSEGV)",
        "a failed canary",
        "a fault (exit code 1)",
        f"a crash (signal {number})",
    ]
    # twice the wait after each short life, up to the longest
    assert lines == [
        "rampe-guard: the guard died of SIGSEGV; it is started anew in 0.05 s",
        "rampe-guard: the guard ended with exit code 3; it is started anew in 0.1 s",
        "rampe-guard: the guard ended with exit code 1; it is started anew in 0.15 s",
        f"rampe-guard: the guard died of signal {number}; it is started anew in 0.15 s",
    ]


HANG = """
import faulthandler
from rampe_guard.runtime.turning import Turning
faulthandler.enable()
turning = Turning()
def stand_still():
    time.sleep(60)
"""


def test_a_loop_that_stands_still_is_killed_says_where_and_is_started_anew(tmp_path: Path) -> None:
    guard = f"""{HANG}
if life == 0:
    turning.feed(0.0)
    stand_still()
if life == 1:
    turning.feed(0.0)
    os.kill(os.getpid(), signal.SIGSTOP)
sys.exit(2)
"""
    with supervise(tmp_path, guard) as parent:
        assert parent.popen.wait(20.0) == 2
        assert "in stand_still" in parent.err
        assert parent.err.count("the guard hung and was killed; it is started anew") == 2
    assert lives(tmp_path) == ["None", "a hang", "a hang"]


def test_neither_loading_nor_saving_is_a_hang(tmp_path: Path) -> None:
    guard = f"""{HANG}
time.sleep(1.5)  # loads, longer than a hang
for turn in range(20):
    turning.feed(float(turn))
    time.sleep(0.05)
turning.end()
time.sleep(1.5)  # saves
sys.exit(0)
"""
    with supervise(tmp_path, guard) as parent:
        assert parent.popen.wait(20.0) == 0
        assert parent.err == ""
    assert lives(tmp_path) == ["None"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_signals_are_passed_on_and_the_end_is_waited_for(
    tmp_path: Path, number: signal.Signals
) -> None:
    with supervise(tmp_path, LIVE) as parent:
        ready(tmp_path)
        (child,) = children(parent)
        parent.signal_and_wait(number)
        assert parent.popen.returncode == 0
        assert not living_pid(child)
    assert lives(tmp_path) == ["None"]


def test_a_guard_that_dies_of_what_was_passed_on_has_ended_well(tmp_path: Path) -> None:
    with supervise(tmp_path, '(folder / "ready").touch(); time.sleep(60)') as parent:
        ready(tmp_path)
        parent.signal_and_wait(signal.SIGTERM)
        assert (parent.popen.returncode, parent.err) == (0, "")


def test_a_guard_that_crashes_on_its_way_out_is_told_by_the_code(tmp_path: Path) -> None:
    guard = """
signal.signal(signal.SIGTERM, lambda *_: os.kill(os.getpid(), signal.SIGSEGV))
(folder / "ready").touch()
time.sleep(60)
"""
    with supervise(tmp_path, guard) as parent:
        ready(tmp_path)
        parent.signal_and_wait(signal.SIGTERM)
        assert parent.popen.returncode == 128 + signal.SIGSEGV
    assert lives(tmp_path) == ["None"]


def test_a_signal_while_it_waits_ends_it(tmp_path: Path) -> None:
    program = SUPERVISE.replace("0.05", "60")
    args = ["-c", program, COUNT + "os.kill(os.getpid(), signal.SIGSEGV)", str(tmp_path)]
    with Process(tmp_path, "supervisor", args) as parent:
        parent.wait_for("started anew in 60 s")
        assert parent.signal_and_wait(signal.SIGTERM) < 20.0
        assert parent.popen.returncode == 0
    assert len(lives(tmp_path)) == 1


@pytest.mark.parametrize("kernel", [True, False], ids=["prctl", "pipe"])
def test_a_guard_ends_when_its_supervisor_is_killed(tmp_path: Path, *, kernel: bool) -> None:
    blind = "" if kernel else "import ctypes; ctypes.CDLL = lambda _: None\n"
    only = "" if not kernel else "import rampe_guard.runtime.supervisor as s; s._outlive = id\n"
    with supervise(tmp_path, blind + only + LIVE) as parent:
        ready(tmp_path)
        (child,) = children(parent)
        parent.popen.kill()
        until(lambda: not living_pid(child), 20.0, f"the end of the guard, process {child}")


def test_a_hang_up_that_was_switched_off_stays_so(tmp_path: Path) -> None:
    program = f"import signal\nsignal.signal(signal.SIGHUP, signal.SIG_IGN)\n{SUPERVISE}"
    with Process(tmp_path, "supervisor", ["-c", program, COUNT + LIVE, tmp_path]) as parent:
        ready(tmp_path)
        (child,) = children(parent)
        os.kill(parent.pid, signal.SIGHUP)
        time.sleep(0.5)  # either would have ended at once
        assert parent.alive
        assert living_pid(child)
        parent.signal_and_wait(signal.SIGTERM)
        assert parent.popen.returncode == 0


def test_the_kernels_folder_is_chosen_anew_unless_a_user_chose_it(tmp_path: Path) -> None:
    show = "import os, rampe_guard\nprint(os.environ['NUMBA_CACHE_DIR'])"
    own = os.environ["NUMBA_CACHE_DIR"]  # of these kernels, as this process chose it
    for set_to, same in (("/x/kernels-0123", False), ("/x/mine", True), (own, True)):
        program = f"import os; os.environ['NUMBA_CACHE_DIR'] = {set_to!r}\n{SUPERVISE}"
        with Process(tmp_path, "supervisor", ["-c", program, show]) as parent:
            assert parent.popen.wait(20.0) == 0
            assert (parent.out.strip() == set_to) is same


def test_it_loads_nothing_that_may_crash(tmp_path: Path) -> None:
    program = (
        "import sys, rampe_guard.cli, rampe_guard.runtime.supervisor\n"
        "print({'numpy', 'numba', 'fcl', 'zenoh', 'msgspec', 'pydantic'} & set(sys.modules))"
    )
    with Process(tmp_path, "imports", ["-c", program]) as done:
        assert done.popen.wait(20.0) == 0
        assert done.out.strip() == "set()"


SPARE = """
import signal, sys
from rampe_guard.runtime.supervisor import Supervisor
command = [sys.executable, "-c", sys.argv[1], *sys.argv[2:]]
sys.exit(
    Supervisor(
        command, first_delay_s=0.05, longest_delay_s=0.1, look_s=0.05, spare_after_s=0.2
    ).run()
)
"""
TAKES_TURNS = """
import os, pathlib, signal, sys, time
from rampe_guard.runtime.life import await_turn, restarted_after, take_name
from rampe_guard.runtime.supervisor import end_with_parent
from rampe_guard.runtime.turning import Turning
folder = pathlib.Path(sys.argv[1])
stop = []
signal.signal(signal.SIGTERM, lambda *_: stop.append(1))
take_name()
end_with_parent()
if not await_turn(lambda: bool(stop)):
    sys.exit(0)
life = len(list(folder.glob("life-*")))
(folder / f"life-{life}").write_text(f"{os.getpid()} {restarted_after()}")
turning, turns = Turning(), 0
while not stop:
    turning.feed(float(turns := turns + 1))
    time.sleep(0.01)
"""


def named(parent: Process) -> dict[str, int]:
    """Processes below a supervisor, by what lists of processes call them."""
    found = {}
    for pid in children(parent):
        name = Path(f"/proc/{pid}/comm").read_text("utf-8").strip()
        if name in {SPARE_NAME, GUARD_NAME}:
            found[name] = pid
    return found


def both(parent: Process, apart_from: int | None = None) -> dict[str, int]:
    def there() -> dict[str, int] | None:
        found = named(parent)
        return found if len(found) == 2 and found.get(GUARD_NAME) != apart_from else None

    return until(there, 20.0, "a guard and a spare")


def test_a_spare_takes_the_place_of_a_guard_that_dies(tmp_path: Path) -> None:
    with Process(tmp_path, "supervisor", ["-c", SPARE, TAKES_TURNS, tmp_path]) as parent:
        for _ in range(2):
            before = both(parent)
            os.kill(before[GUARD_NAME], signal.SIGKILL)
            after = both(parent, apart_from=before[GUARD_NAME])
            assert after[GUARD_NAME] == before[SPARE_NAME]
        family = children(parent)
        assert parent.signal_and_wait(signal.SIGTERM) < 5.0
    assert lives(tmp_path) == ["None", "a crash (SIGKILL)", "a crash (SIGKILL)"]
    assert not [pid for pid in family if living_pid(pid)]


def test_a_spare_that_was_killed_is_replaced(tmp_path: Path) -> None:
    with Process(tmp_path, "supervisor", ["-c", SPARE, TAKES_TURNS, tmp_path]) as parent:
        before = both(parent)
        os.kill(before[SPARE_NAME], signal.SIGKILL)
        until(lambda: before[SPARE_NAME] not in children(parent), 20.0, "an end of the spare")
        after = both(parent)
        assert after[GUARD_NAME] == before[GUARD_NAME]
        parent.signal_and_wait(signal.SIGTERM)
    assert lives(tmp_path) == ["None"]


def test_a_spare_ends_with_its_supervisor_however_that_dies(tmp_path: Path) -> None:
    with Process(tmp_path, "supervisor", ["-c", SPARE, TAKES_TURNS, tmp_path]) as parent:
        family = both(parent)
        parent.popen.kill()
        until(lambda: not any(living_pid(pid) for pid in family.values()), 20.0, "an end of both")


def test_a_spare_that_does_not_wake_is_not_waited_for(tmp_path: Path) -> None:
    with Process(tmp_path, "supervisor", ["-c", SPARE, TAKES_TURNS, tmp_path]) as parent:
        before = both(parent)
        os.kill(before[SPARE_NAME], signal.SIGSTOP)
        os.kill(before[GUARD_NAME], signal.SIGKILL)
        after = both(parent, apart_from=before[GUARD_NAME])
        assert before[SPARE_NAME] not in after.values()
        parent.signal_and_wait(signal.SIGTERM)
    assert lives(tmp_path) == ["None", "a crash (SIGKILL)"]
    assert not living_pid(before[SPARE_NAME])
