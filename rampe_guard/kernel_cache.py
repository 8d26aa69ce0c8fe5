"""Where the compiled kernels of the sweep are kept.

numba looks only at the file of the outermost kernel when it asks whether its machine code is
still good. So the folder's name carries a digest of all kernels and of the compiler: change one,
and all are compiled anew. Within it numba gives each place where the package lies a folder of its
own; we link all these to one, so that a checkout, a wheel and the next installation of the same
kernels compile once between them. Python and processor are told apart by numba, in its file names
and its index.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path

COMPILED = ("search_kernel.search-*.nbi", "box_kernel.any_way-*.nbi")
"""What numba keeps of the outermost kernels, those that are called from outside."""
KERNELS = ("*_kernel.py", "gjk.py", "kernel_data.py", "compiled.py")
COMPILER = {"numba": "_version.py", "llvmlite": "_version.py", "numpy": "version.py"}
"""Packages that decide what the machine code is, and the file that holds their version: reading
it is quicker than to import them."""
KEPT_FOLDERS = 4
UNUSED_S = 24 * 3600.0
"""Folders of other kernels are kept if used as late as this before the newest [s], or among so
many newest: two versions may take turns on a machine."""
_CORE = Path(__file__).parent / "core"
_SHARED = "shared"


def choose_folder() -> None:
    """Tell numba, unless the environment does; before it is imported.

    Where no folder of the user's can be written, numba's own choice is left to it.
    """
    name = f"kernels-{_digest()}"
    told = Path(os.environ.get("NUMBA_CACHE_DIR", ""))
    if told.name == name:  # by the process that started this one
        _share(told)
        return
    if told.name and not told.name.startswith("kernels-"):
        return  # by the user
    chosen = os.environ.get("RAMPE_GUARD_CACHE")
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    base = Path(chosen) if chosen else home / "rampe-guard"
    folder = base / name
    new = not folder.exists()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return
    if os.access(folder, os.W_OK):
        os.environ["NUMBA_CACHE_DIR"] = str(folder)
        _share(folder)
        with suppress(OSError):
            os.utime(folder)  # used just now
        if new:
            forget_old(base)


def forget_old(base: Path) -> None:
    """Delete the folders of kernels that nobody has used for longest, all but the newest few."""
    used = []
    for folder in base.glob("kernels-*"):
        with suppress(OSError):  # another process may be deleting too
            used.append((folder.stat().st_mtime, folder))
    used.sort(reverse=True)
    for when, folder in used[KEPT_FOLDERS:]:
        if when < used[0][0] - UNUSED_S:
            shutil.rmtree(folder, ignore_errors=True)


def kept() -> bool:
    """Whether this very package has compiled kernels; else the first sweep takes a minute."""
    folder = _folder()
    return folder is not None and all(any(folder.glob(name)) for name in COMPILED)


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


def _digest() -> str:
    """Of all that decides the machine code, but Python and the processor."""
    digest = hashlib.sha256()
    for pattern in KERNELS:
        for file in sorted(_CORE.glob(pattern)):
            digest.update(file.read_bytes())
    for package, version in COMPILER.items():
        spec = find_spec(package)
        if spec is not None and spec.origin is not None:
            with suppress(OSError):
                digest.update(Path(spec.origin).with_name(version).read_bytes())
    return digest.hexdigest()[:16]


def _share(folder: Path) -> None:
    """Where numba will keep the kernels of this very place, put a link to what all places share.

    The name is numba's (`get_suitable_cache_subpath`). If another release chooses another, or
    links cannot be made, each place has its own folder again, and compiles for itself.
    """
    place = os.path.abspath(_CORE)  # noqa: PTH100  # as numba does, links unresolved
    own = folder / f"{_CORE.name}_{hashlib.sha1(place.encode(), usedforsecurity=False).hexdigest()}"
    with suppress(OSError):
        (folder / _SHARED).mkdir(exist_ok=True)
        own.symlink_to(_SHARED)
