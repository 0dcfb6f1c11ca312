"""The distributions of published plans that homes are drawn from: ``published.json``, which holds no plan.

``research/home_statistics.py`` writes it.
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

TABLE: Final = Path(__file__).with_name("published.json")
COUNTED: Final = ("spaces", "rooms", "nameless")
NUMBERS: Final = ("area_m2", "aspect", "extent", "corners", "oblique", "wall_m", "unevenness", "least_room")
STRATA: Final = (1, 2, 3, 4, 5, 6, 7, 9, 12)
"""The least number of spaces of each stratum."""


def stratum_of(spaces: int) -> int:
    """Return the index of the stratum that holds houses of so many spaces."""
    return int(np.searchsorted(STRATA, max(spaces, 1), side="right")) - 1


@cache
def table() -> dict[str, Any]:
    """Return the published distributions."""
    found: dict[str, Any] = json.loads(TABLE.read_text(encoding="utf-8"))
    return found


@cache
def table_digest() -> str:
    """Return what stands for the table in what a build depends on."""
    return hashlib.sha256(TABLE.read_bytes()).hexdigest()[:16]
