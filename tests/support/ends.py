"""Programs of ours that start many processes end them, whichever way they are told to end."""

from __future__ import annotations

import signal


def end_on_signals() -> None:
    """SIGINT and SIGTERM raise KeyboardInterrupt; a shell's ``&`` would have them ignore the first."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
