"""A target that is a command: alert in its words, its environment and on its stdin."""

from __future__ import annotations

import json

from rampe_guard.notify.child import Runner, Template
from rampe_guard.notify.choose import Notice

FIELDS = (
    "event",
    "over",
    "level",
    "text",
    "site",
    "machine",
    "base",
    "zone",
    "link",
    "state",
    "alert_id",
    "protection",
)
"""Fields of a notice that are given one by one; what a notice has not is empty."""
_LONGEST = 1000
"""An argument may not be endless, or nothing can be run."""


class Command:
    """Runs a command for each notice.

    Args:
        line: the command; `FIELDS` in braces are replaced.
        timeout_s: then it is killed [s].

    Raises:
        SettingsError: it cannot be run.
    """

    def __init__(self, line: str, timeout_s: float) -> None:
        self.name = f"command {line.split(maxsplit=1)[0] if line.strip() else line!r}"
        self._template = Template(line, FIELDS)
        self._timeout_s = timeout_s
        self._runner = Runner()

    def tell(self, notice: Notice) -> None:
        """Run it; see `Runner.run`."""
        values = {name: _word(notice.body.get(name)) for name in FIELDS}
        variables = {f"RAMPE_{name.upper()}": value for name, value in values.items()}
        stdin = json.dumps(notice.body, ensure_ascii=False).encode() + b"\n"
        self._runner.run(self._template.fill(values), self._timeout_s, stdin, variables)

    def stop(self) -> None:
        """Break it off."""
        self._runner.stop()


def _word(value: object) -> str:
    """Plain text that a process can be given, and a terminal shown; all of it is on stdin."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return "".join(letter if letter.isprintable() else "?" for letter in str(value)[:_LONGEST])
