"""Programs of ours that start many processes end them, whichever way they are told to end."""

from __future__ import annotations

import signal


def end_on_signals() -> None:
    """Both raise KeyboardInterrupt; what a shell starts with ``&`` would ignore SIGINT."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
