"""Where the compiled kernels of the sweep are kept.

numba looks only at the file of the outermost kernel when it asks whether its machine code is
still good. So the folder's name carries a digest of all kernels: change one, and all are
compiled anew.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

COMPILED = "search_kernel.search-*.nbi"
"""What numba keeps of the outermost kernel."""
KERNELS = ("*_kernel.py", "gjk.py", "kernel_data.py", "compiled.py")


def choose_folder() -> None:
    """Tell numba, unless the environment does; before it is imported.

    Where no folder of the user's can be written, numba's own choice is left to it.
    """
    core = Path(__file__).parent / "core"
    digest = hashlib.sha256()
    for pattern in KERNELS:
        for file in sorted(core.glob(pattern)):
            digest.update(file.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    told = Path(os.environ.get("NUMBA_CACHE_DIR", "")).name
    if told and (told == name or not told.startswith("kernels-")):
        return  # by the user, or by the process that started this one, for the same kernels
    chosen = os.environ.get("RAMPE_GUARD_CACHE")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    base = Path(chosen) if chosen else home / "rampe-guard"
    folder = base / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    if os.access(folder, os.W_OK):
        os.environ["NUMBA_CACHE_DIR"] = str(folder)


def kept() -> bool:
    """Whether this very package has compiled kernels; else the first sweep takes a minute."""
    folder = _folder()
    return folder is not None and any(folder.glob(COMPILED))


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Compile in here: who comes second waits for the first, and then finds it done."""
    folder = _folder()
    if folder is None or kept():
        yield
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / "lock").open("w")
    except OSError:  # then each compiles for itself
        yield
        return
    with lock:  # closing it lets go
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _folder() -> Path | None:
    """Where numba keeps the outermost kernel; None if it keeps nothing."""
    # not before the folder is chosen
    from rampe_guard.core.search_kernel import search  # noqa: PLC0415

    path = getattr(getattr(search, "stats", None), "cache_path", None)
    return None if path is None else Path(path)
