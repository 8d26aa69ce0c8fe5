"""``python -m rampe_guard``: the same as the command ``rampe-guard``."""

from __future__ import annotations

import sys

from rampe_guard.cli import main

sys.exit(main())
