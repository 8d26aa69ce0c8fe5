"""The one place that knows by what the sweep's kernels are compiled.

numba turns a function of numbers and arrays into machine code at its first call and keeps it on
disk (see `rampe_guard.kernel_cache`). Kernels never raise, and use strict IEEE arithmetic: no
fast-math, for a proof must not be reordered. They allocate nothing, so numba need not count who
refers to an array; counting took half of the time of a sweep.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar, cast

import numba

if TYPE_CHECKING:
    from collections.abc import Callable

_HOW: dict[str, Any] = {"error_model": "numpy", "fastmath": False, "_nrt": False}
F = TypeVar("F", bound="Callable[..., object]")


def compiled(function: F) -> F:
    """Compile a kernel with numba, cached on disk."""
    try:
        wrapped = numba.njit(cache=True, **_HOW)(function)
    except RuntimeError:  # no folder can be written: compile at each start
        wrapped = numba.njit(**_HOW)(function)
    return cast("F", wrapped)


def inlined(function: F) -> F:
    """The same for small functions that the machine code of their callers should contain."""
    return cast("F", numba.njit(**_HOW)(function))
