"""Stub."""

from rampe_guard.evaluate.report_model import Report


def page(made: Report) -> str:
    """Stub."""
    return made.name
