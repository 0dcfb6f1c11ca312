"""Plans that are implausible for a house, because a unit or a scale was wrong.

R1  A room of more than ``MAX_ROOM_M2`` in the mean is a field; it comes of units that are too large.
R2  A room of less than ``MIN_ROOM_M2`` in the mean is a cupboard; it comes of units that are too small.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

MAX_ROOM_M2: Final = 500.0
MIN_ROOM_M2: Final = 2.5
ADVICE: Final = "check --units, --scale and --storey-height"

_NAMED = 8


def implausible(rooms: int, area_m2: float) -> str:
    """Say what is odd about a plan with this number of rooms and this free area, or return an empty text."""
    each = area_m2 / max(rooms, 1)
    if MIN_ROOM_M2 <= each <= MAX_ROOM_M2:
        return ""
    what = "1 room" if rooms <= 1 else f"{rooms} rooms"
    return f"{what} of {each:,.{0 if each > 10 else 1}f} m2" + (" in the mean" if rooms > 1 else "")


def implausible_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield a line for each plan that is no house, by the rows of the index, and one that counts those left out."""
    found = [(row["id"], odd) for row in rows if (odd := implausible(row["room_num"], row["area"]))]
    for name, odd in found[:_NAMED]:
        yield f"implausible: {name}: {odd}; {ADVICE}"
    if len(found) > _NAMED:
        yield f"implausible: {len(found) - _NAMED} more"
