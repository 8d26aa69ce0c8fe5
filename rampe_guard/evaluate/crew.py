"""Who does the work: this process, some processes of this machine, or a Dask cluster.

A sequence (one operator on one machine, logs in order) is three lines of work (`stages`) that
know nothing of one another. Sequences and lines go side by side; within a line each piece waits
for the one before it, since it starts from what that one learned. Who does the work changes how
long it takes and nothing else.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Final

from rampe_guard import __version__
from rampe_guard.errors import ConnectionFailedError, RampeGuardError
from rampe_guard.evaluate.guard_trace import GuardRun
from rampe_guard.evaluate.prediction import Prediction
from rampe_guard.evaluate.stages import Piece, Work, guard_piece, prediction_piece, work_piece

_PATIENCE_S = 10.0
_ONE_THREAD: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Matrices here are small: threads inside them cost more than they bring."""


@dataclass(frozen=True, slots=True)
class Order:
    """A sequence that is to be evaluated.

    Attributes:
        name: for people.
        site: path of the site file.
        logs: paths, in the order in which they are learned.
        fresh: each log starts from nothing.
        frozen: only so many logs teach, and only the others are judged; None for all.
    """

    name: str
    site: str
    logs: tuple[str, ...]
    fresh: bool = False
    frozen: int | None = None

    def piece(self, index: int) -> Piece:
        """One log of it."""
        learn = self.frozen is None or index < self.frozen
        return Piece(self.site, self.logs[index], learn)


@dataclass(frozen=True, slots=True)
class Findings:
    """All that was found out about a sequence, log by log."""

    order: Order
    works: tuple[Work, ...]
    guards: tuple[GuardRun, ...]
    prediction: Prediction


Call = tuple[Callable[..., Any], tuple[Any, ...]]
Tell = Callable[[int, int], None]
"""Takes how many pieces are done, and of how many."""


@dataclass(slots=True)
class _Logs:
    """A line that goes through the logs one by one and hands on what was learned."""

    order: Order
    piece: Callable[[Piece, Any], Any]
    found: list[Any] = field(default_factory=list)

    @property
    def length(self) -> int:
        return len(self.order.logs)

    def next(self) -> Call | None:
        index = len(self.found)
        if index == len(self.order.logs):
            return None
        known = None if self.order.fresh or not index else self.found[-1].knowledge
        return self.piece, (self.order.piece(index), known)


@dataclass(slots=True)
class _Forecasts:
    """The forecasts of the next displacement: one piece, since its units are of all logs."""

    order: Order
    found: list[Any] = field(default_factory=list)
    length: int = 1

    def next(self) -> Call | None:
        if self.found:
            return None
        order = self.order
        return prediction_piece, (order.site, order.logs, order.fresh, order.frozen)


def evaluate_all(orders: Sequence[Order], crew: Executor, tell: Tell) -> tuple[Findings, ...]:
    """Do all the work of all orders; results are in the order given.

    Raises:
        RampeGuardError: a file cannot be used; the rest of the work is called off.
    """
    sequences = [
        (order, _Logs(order, guard_piece), _Logs(order, work_piece), _Forecasts(order))
        for order in orders
    ]
    lines: list[_Logs | _Forecasts] = [
        line for _, guards, works, forecasts in sequences for line in (forecasts, guards, works)
    ]
    total, done = sum(line.length for line in lines), 0
    tell(0, total)
    waiting: dict[Future[Any], _Logs | _Forecasts] = {}
    try:
        for line in lines:
            _give(crew, line, waiting)
        while waiting:
            finished, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in finished:
                line = waiting.pop(future)
                line.found.append(future.result())
                done += 1
                tell(done, total)
                _give(crew, line, waiting)
    except CancelledError:
        raise ConnectionFailedError("the cluster gave up the work") from None
    finally:
        for future in waiting:
            future.cancel()
    return tuple(
        Findings(order, tuple(works.found), tuple(guards.found), forecasts.found[0])
        for order, guards, works, forecasts in sequences
    )


def _give(
    crew: Executor, line: _Logs | _Forecasts, waiting: dict[Future[Any], _Logs | _Forecasts]
) -> None:
    call = line.next()
    if call is not None:
        waiting[crew.submit(call[0], *call[1])] = line


class _Here(Executor):
    """This process, one piece after the other."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - whoever waits for the result gets it
            future.set_exception(error)
        return future


@contextmanager
def crew(jobs: int, scheduler: str | None = None) -> Iterator[Executor]:
    """Whoever does the work, for as long as it is needed.

    Args:
        jobs: processes of this machine; 1 is this very process.
        scheduler: address of a Dask scheduler, which then gives the work to its workers.

    Raises:
        ConnectionFailedError: the scheduler does not answer, or has no worker.
        RampeGuardError: the extra is missing, or a worker has another version.
    """
    if scheduler is not None:
        with _cluster(scheduler) as executor:
            yield executor
    elif jobs == 1:
        yield _Here()
    else:
        with _environment(dict.fromkeys(_ONE_THREAD, "1")):
            pool = ProcessPoolExecutor(
                jobs,
                mp_context=multiprocessing.get_context("spawn"),
                initializer=_begin,
                initargs=(os.getpid(),),
            )
            try:
                yield pool
            finally:
                pool.shutdown(cancel_futures=True)


def _begin(parent: int) -> None:
    """In a process of the pool: end without a word when told to, and with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if os.getppid() != parent:
        sys.exit(0)


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """Some environment variables for processes that are started meanwhile."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    try:
        from distributed import Client  # noqa: PLC0415 - an extra, and slow to load
    except ModuleNotFoundError as error:
        raise RampeGuardError(
            f"--scheduler needs {error.name}, which is not installed: pip install"
            " 'rampe-guard[fleet]'"
        ) from error
    try:
        client = Client(  # type: ignore[no-untyped-call]
            address, timeout=_PATIENCE_S, set_as_default=False
        )
    except (OSError, TimeoutError, ValueError) as error:
        raise ConnectionFailedError(f"no Dask scheduler answers at {address}: {error}") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE_S)
        except TimeoutError as error:
            raise ConnectionFailedError(f"the Dask scheduler at {address} has no worker") from error
        versions = client.run(_version)
        other = {where: found for where, found in versions.items() if found != __version__}
        if other:
            where, found = next(iter(other.items()))
            raise RampeGuardError(
                f"the worker at {where} has rampe-guard {found}, this is {__version__}"
            )
        yield client.get_executor(pure=False)  # type: ignore[no-untyped-call]


def _version() -> str:
    return __version__
