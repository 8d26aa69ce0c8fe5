"""What the loops around the peers are compiled by: numba, free to allocate."""

from __future__ import annotations

import numba

compiled = numba.njit(cache=True, error_model="numpy")
inlined = numba.njit(error_model="numpy")
