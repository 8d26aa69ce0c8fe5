"""How a log record becomes one line on stderr, as plain text or as JSON, without ever waiting.

What comes from the network (names of people, keys, texts of errors) stands in these lines, so
nothing in it may end a line, move a terminal's cursor, or turn the direction of writing: such
characters are written as their escapes. A reader of stderr that is stuck costs lines and never
time: they are written by a thread, and what does not fit its queue is counted and said later.
"""

from __future__ import annotations

import contextlib
import json
import logging
import queue
import re
import sys
import threading
import time
from collections.abc import Sequence
from typing import Final, Literal, TextIO, TypeAlias

LogFormat: TypeAlias = Literal["text", "json"]
FORMATS: Final[tuple[LogFormat, ...]] = ("text", "json")
FIELDS: Final = "rampe_fields"
"""Attribute of a record: what `Sayer` was given beside the text."""
LONGEST: Final = 4000
"""Characters of a text; a line longer than this is an attack or a mistake."""
_WAITING: Final = 1000
_LAST_S: Final = 0.5
"""How long the end of the process waits for lines that are not written yet."""
_UNSEEN: Final = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2069\ufeff\ud800-\udfff]"
)


def one_line(text: str) -> str:
    r"""The text with what a terminal would act on written as escapes, such as ``\x0a``."""
    if len(text) > LONGEST:
        text = f"{text[:LONGEST]}… ({len(text)} characters)"
    return _UNSEEN.sub(_escape, text)


def _escape(found: re.Match[str]) -> str:
    code = ord(found[0])
    return f"\\x{code:02x}" if code <= 0xFF else f"\\u{code:04x}"  # noqa: PLR2004 - two digits


class TextLines(logging.Formatter):
    """Local time, level, logger, text; a traceback keeps its lines."""

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)s %(name)s: %(message)s")

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - its name
        """The line itself."""
        record.message = one_line(record.message)
        return super().formatMessage(record)


class JsonLines(logging.Formatter):
    """One object a line: time (UTC), level, logger, text, and the fields beside it."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        seconds = time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(record.created))
        line: dict[str, object] = {
            "time": f"{seconds}.{int(record.msecs):03d}Z",
            "level": record.levelname.lower(),
            "logger": record.name,
            "text": one_line(record.getMessage()),
        }
        fields = getattr(record, FIELDS, None)
        if fields:
            line["fields"] = {
                name: one_line(value) if isinstance(value, str) else value
                for name, value in fields.items()
            }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line, default=str)


class Behind(logging.Handler):
    """Writes lines from a thread of its own, so that nobody who says something ever waits.

    Args:
        out: where to.
    """

    def __init__(self, out: TextIO) -> None:
        super().__init__()
        self._out = out
        self._lines: queue.Queue[logging.LogRecord | None] = queue.Queue(_WAITING)
        self._lost = 0
        # a daemon: a terminal that is stopped must not keep the process from ending
        self._thread = threading.Thread(target=self._work, name="log", daemon=True)
        self._thread.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Have it written."""
        try:
            self._lines.put_nowait(record)
        except queue.Full:
            self._lost += 1

    def close(self) -> None:
        """Write what waits; for half a second at most."""
        with contextlib.suppress(queue.Full):
            self._lines.put_nowait(None)
        self._thread.join(_LAST_S)
        super().close()

    def _work(self) -> None:
        while (record := self._lines.get()) is not None:
            self._write(record)
            if self._lost and self._lines.empty():
                lost, self._lost = self._lost, 0
                text = f"{lost} lines are missing here: they were not read as fast as said"
                self._write(_record(logging.WARNING, text))

    def _write(self, record: logging.LogRecord) -> None:
        try:
            text = self.format(record)
        except Exception:  # noqa: BLE001 - one line that cannot be made must not end all the others
            self._lost += 1
            return
        with contextlib.suppress(OSError, ValueError):  # nobody reads it any more
            self._out.write(f"{text}\n")
            self._out.flush()


def configure(form: LogFormat = "text", level: int = logging.INFO) -> None:
    """Log to stderr; called by commands, never by the library."""
    root = logging.getLogger()
    if root.handlers:  # as `logging.basicConfig`: what is there already stays
        return
    handler = Behind(sys.stderr)
    handler.setFormatter(JsonLines() if form == "json" else TextLines())
    root.addHandler(handler)
    root.setLevel(level)


def complaint(lines: Sequence[str], form: LogFormat = "text") -> str:
    """The last words of a command that cannot go on: a line each, or one object of all of them."""
    if form == "json":
        return JsonLines().format(_record(logging.ERROR, "\n".join(lines)))
    return "rampe-guard: " + "\n".join(map(one_line, lines))


def _record(level: int, text: str) -> logging.LogRecord:
    return logging.LogRecord("rampe_guard", level, __file__, 0, text, None, None)
