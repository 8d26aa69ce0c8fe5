"""Files of ``rampe-guard init``: written, and taken back if a guard could not use them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rampe_guard.errors import RampeGuardError, SettingsError


@contextmanager
def written(texts: Mapping[Path, str], more: str = "") -> Iterator[None]:
    """``texts`` are in their files; if what is done with them fails, it is as it was before.

    Args:
        texts: by file.
        more: to add to an error.

    Raises:
        SettingsError: a file cannot be written, or what was done with them failed.
    """
    before = {path: path.read_bytes() if path.exists() else None for path in texts}
    try:
        for path, text in texts.items():
            _write(path, text)
        yield
    except BrokenPipeError:
        raise  # `| head` has seen enough, which says nothing of the files
    except BaseException as error:
        for path, content in before.items():
            if content is None:
                path.unlink(missing_ok=True)
            else:
                path.write_bytes(content)
        if not isinstance(error, RampeGuardError):
            raise
        nothing = "nothing was written, or all is as it was before"
        raise SettingsError(*error.lines, f"{nothing}{more}") from None


def to_do(path: Path, text: str) -> str:
    """How many lines of a file somebody must look at, in words; empty if none."""
    count = sum("TODO" in line for line in text.splitlines() if not line.startswith("# "))
    lines = "line" if count == 1 else "lines"
    return f"{count} {lines} marked TODO in {path}" if count else ""


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise SettingsError(f"{path}: cannot be written ({error.strerror})") from None
