"""The file of one operator's model on one machine: where it is, and how it survives a crash.

A save writes a temporary file beside the old one, brings it to the disk, and then renames it
over the old one, which a file system does wholly or not at all. So whatever moment the power
fails at, the old or the new model is there, complete. A file that cannot be used is renamed,
never overwritten: it may be all that is left of a year's learning.

A guard holds a lock (``flock``) on ``NAME.lock`` for as long as it runs; the kernel frees it
when the process ends, however it ends. Two guards never write one model, and nobody deletes
a model that a running guard would write again.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import re
import stat
from pathlib import Path
from types import TracebackType
from typing import Self

from rampe_guard.errors import ModelFileError
from rampe_guard.runtime.store_format import MAX_BYTES, MAX_SITUATION_BYTES
from rampe_guard.settings import Site

SUFFIX = ".npz"
SITUATIONS_SUFFIX = ".situations.npz"
"""Of the file beside it that holds the remembered situations; no operator's name has a dot."""
_PRIVATE_FILE, _PRIVATE_FOLDER = 0o600, 0o700
"""How a person works is nobody else's business."""
_PLAIN = re.compile(r"[a-z0-9][a-z0-9_-]*")


def model_folder(site: Site) -> Path:
    """The folder of all operators' models of a machine.

    Raises:
        ModelFileError: there is no directory to keep it in.
    """
    return _state_directory(site) / safe_name(site.name) / safe_name(site.machine)


def model_path(site: Site) -> Path:
    """The file of the site's operator; `ModelFileError` as `model_folder`."""
    return model_folder(site) / (safe_name(site.operator) + SUFFIX)


def situations_file(model: Path) -> ModelFile:
    """The file of the situations that are remembered beside a model."""
    path = model.with_name(model.name.removesuffix(SUFFIX) + SITUATIONS_SUFFIX)
    return ModelFile(path, MAX_SITUATION_BYTES)


def safe_name(name: str) -> str:
    """A name as that of one file: the same for the same name, another for any other.

    Lower-case letters, digits, - and _ stay as they are. Anything else becomes -, and a ~ with
    the begin of the name's SHA-256 follows; a plain name has no ~, so the two never meet, not
    even where a file system takes Anna for anna.
    """
    if _PLAIN.fullmatch(name):
        return name
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:16]
    plain = re.sub(r"[^a-z0-9_-]+", "-", name.lower()).strip("-")[:40]
    return f"{plain}~{digest}"


def _state_directory(site: Site) -> Path:
    if site.memory.directory is not None:
        return Path(site.memory.directory)
    # systemd gives a list when a unit has several
    from_systemd = os.environ.get("STATE_DIRECTORY", "").split(":")[0]
    if from_systemd:
        return Path(from_systemd).absolute()
    from_xdg = os.environ.get("XDG_STATE_HOME", "")
    if Path(from_xdg).is_absolute():  # the specification: a relative path is to be ignored
        return Path(from_xdg) / "rampe-guard"
    try:
        return Path.home() / ".local" / "state" / "rampe-guard"
    except RuntimeError:
        raise ModelFileError(
            "there is no home directory to keep models in; give memory.directory in the site file"
        ) from None


class ModelFile:
    """One model's file. Writing, renaming and deleting need the lock: a context manager.

    Args:
        path: of the file; its folder is made when the lock is taken.
        most_bytes: a larger file is not read.
    """

    def __init__(self, path: Path, most_bytes: int = MAX_BYTES) -> None:
        self.path = path
        self._most_bytes = most_bytes
        self._temporary = path.with_name(path.name + ".tmp")
        self._lock_path = path.with_name(path.name + ".lock")
        self._lock: int | None = None

    def lock(self) -> None:
        """Hold the file until `release`, and clear away what a crash left.

        Raises:
            ModelFileError: another process holds it, or the folder cannot be written.
        """
        try:
            self.path.parent.mkdir(_PRIVATE_FOLDER, parents=True, exist_ok=True)
            while self._lock is None:
                self._lock = self._try_lock()
            self._temporary.unlink(missing_ok=True)
        except OSError as error:
            self.release()
            raise ModelFileError(f"{self.path.parent}: {error.strerror or error}") from None

    def _try_lock(self) -> int | None:
        """A locked descriptor; None if the lock file was deleted under our hands."""
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC
        descriptor = os.open(self._lock_path, flags, _PRIVATE_FILE)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if not self._is_lock(descriptor):
                os.close(descriptor)
                return None
            os.truncate(descriptor, 0)
            os.write(descriptor, f"{os.getpid()}\n".encode())
        except BlockingIOError:
            holder = os.pread(descriptor, 20, 0).decode("ascii", "replace").strip()
            os.close(descriptor)
            raise ModelFileError(
                f"{self.path} is held by a running guard, process {holder or 'unknown'};"
                " stop that first"
            ) from None
        except BaseException:
            os.close(descriptor)
            raise
        return descriptor

    def _is_lock(self, descriptor: int) -> bool:
        try:
            return os.path.samestat(os.fstat(descriptor), self._lock_path.stat())
        except FileNotFoundError:
            return False

    @property
    def locked(self) -> bool:
        """Whether it is ours to write."""
        return self._lock is not None

    def release(self) -> None:
        """Give the lock back."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def read(self) -> bytes | None:
        """What is in the file; None if there is none.

        Raises:
            ModelFileError: it cannot be read, or is too large to be a model.
        """
        try:
            # without O_NONBLOCK a pipe in its place would let us wait for ever
            descriptor = os.open(self.path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise ModelFileError(f"it cannot be read: {error.strerror or error}") from None
        try:
            status = os.fstat(descriptor)
            if not stat.S_ISREG(status.st_mode):
                raise ModelFileError("it is not a regular file")
            if status.st_size > self._most_bytes:
                raise ModelFileError(f"it has {status.st_size >> 20} MiB, too much for a model")
            with os.fdopen(descriptor, "rb", closefd=False) as file:
                return file.read(self._most_bytes)
        except OSError as error:
            raise ModelFileError(f"it cannot be read: {error.strerror or error}") from None
        finally:
            os.close(descriptor)

    def write(self, content: bytes) -> None:
        """Replace the file, wholly or not at all, and durably.

        Raises:
            ModelFileError: it could not be written; the old one is still there.
        """
        self._check_lock()
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC
        try:
            descriptor = os.open(self._temporary, flags, _PRIVATE_FILE)
            with os.fdopen(descriptor, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            self._temporary.replace(self.path)
            self._sync_folder()
        except OSError as error:
            with contextlib.suppress(OSError):
                self._temporary.unlink(missing_ok=True)
            raise ModelFileError(f"{self.path}: {error.strerror or error}") from None

    def remove(self) -> None:
        """Delete the file, if there is one, durably.

        Raises:
            ModelFileError: it could not be deleted.
        """
        self._check_lock()
        try:
            self.path.unlink(missing_ok=True)
            self._sync_folder()
        except OSError as error:
            raise ModelFileError(f"{self.path}: {error.strerror or error}") from None

    def set_aside(self) -> Path:
        """Rename the file to a ``.refused-N`` that does not exist yet; returns that.

        Raises:
            ModelFileError: it could not be renamed; it is still there.
        """
        self._check_lock()
        number = 1
        while os.path.lexists(aside := self._aside(number)):
            number += 1
        try:
            self.path.rename(aside)
            self._sync_folder()
        except OSError as error:
            raise ModelFileError(f"{self.path}: {error.strerror or error}") from None
        return aside

    def delete(self) -> list[Path]:
        """Delete the file, refused ones of its name and the lock; returns the models deleted.

        Raises:
            ModelFileError: something could not be deleted.
        """
        self._check_lock()
        deleted = []
        try:
            for path in self.all_models():
                path.unlink()
                deleted.append(path)
            self._lock_path.unlink(missing_ok=True)
            self._sync_folder()
        except OSError as error:
            raise ModelFileError(f"{error.filename or self.path}: {error.strerror}") from None
        return deleted

    def all_models(self) -> list[Path]:
        """The file and those refused under its name, as far as they exist."""
        start = self._aside("").name
        try:
            names = sorted(path.name for path in self.path.parent.iterdir())
        except FileNotFoundError:
            return []
        found = [n for n in names if n.startswith(start) and n[len(start) :].isdecimal()]
        mine = [self.path.name] if self.path.name in names else []
        return [self.path.with_name(name) for name in (*mine, *found)]

    def _aside(self, number: int | str) -> Path:
        return self.path.with_name(f"{self.path.name}.refused-{number}")

    def _sync_folder(self) -> None:
        """A rename is on the disk only when its folder is."""
        descriptor = os.open(self.path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def _check_lock(self) -> None:
        if self._lock is None:
            raise RuntimeError(f"{self.path} is not locked")

    def __enter__(self) -> Self:
        self.lock()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.release()
