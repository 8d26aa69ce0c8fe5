"""rampe-guard: collision early warning for machines that a person drives."""

from __future__ import annotations

__version__ = "0.1.0"
