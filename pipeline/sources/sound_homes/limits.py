"""Judge the rooms of a layout: whether they keep the limits of their labels, and how near they are to what is wanted.

R1  Rooms keep the least area and width and the largest aspect of their label (``LIMITS``, stricter than the limits of
    ``houseexpo.analysis.audit``).
R2  A room has at most ``MOST_RATIO`` times the area that is asked for, and 5 m2 more; a store may be larger.
R3  A storey has at most one cupboard or smallest of toilets, and only in some kinds of dwellings.
R4  A kitchen has at least a sixth of the living room's area, and no less than the largest bath.
R5  In a dwelling of one storey the living room follows the number of bedrooms.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

import shapely

from pipeline.sources.sound_homes.values import HALL, SLEEPING, STAIRS, Cell, Programme


class _Limits(NamedTuple):
    """The least area and width of a room, and the largest ratio of its sides (R1)."""

    area_m2: float
    width_m: float
    aspect: float


LIMITS: Final = {
    "Living_Room": _Limits(12.0, 3.0, 2.0),
    "Kitchen": _Limits(3.8, 1.75, 2.4),
    "Dining_Room": _Limits(6.0, 2.3, 2.0),
    "Bedroom": _Limits(8.5, 2.6, 1.8),
    "Child_Room": _Limits(8.0, 2.5, 1.8),
    "Office": _Limits(6.5, 2.2, 2.0),
    "Bathroom": _Limits(2.5, 1.45, 2.6),
    "Toilet": _Limits(1.52, 1.0, 2.7),
    "Storage": _Limits(1.0, 0.7, 3.0),
    "Wardrobe": _Limits(1.0, 0.8, 3.2),
    "Garage": _Limits(14.0, 3.0, 2.4),
    "Entryway": _Limits(1.4, 1.15, 3.2),
}
MOST_RATIO: Final = 1.7
_MOST_MORE_M2: Final = 5.0
_TINY: Final = (1.5, 0.86)
"""Smaller (m2) or narrower (m) than that, a room is a cupboard or the smallest of toilets (R3)."""
_MAY_BE_TINY: Final = frozenset({"flat", "shared flat", "studio"})
_KITCHEN_SHARE: Final = 1 / 6
"""Of the living room (R4). In Swiss Dwellings 5% of the kitchens (4.6 m2) are smaller than that of its median."""
_ONE_STOREY: Final = frozenset({"flat", "bungalow"})
_MOST_LIVING_M2: Final = 33.0
_LEAST_LIVING_M2: Final = 22.0
"""What a living room has with one bedroom at most, with three or more at least (R5): 75 and 25% in Swiss Dwellings."""
_HALL_M2: Final = 0.6
"""What a hall has for each room without being too large. Few are so small; what comes nearest has about the median
of Swiss Dwellings, 7.5 m2."""
_HALL_WEIGHT: Final = 12.0
_SLIM_M: Final = 1.0
"""A hall that is wider than this and a fifth of a metre may be larger."""


def distance_from_wishes(
    labels: Sequence[str], areas_m2: Sequence[float], cells: Iterable[Cell], programme: Programme
) -> float | None:
    """Return how far the areas of rooms are from those asked for (0 for none), or None if a room breaks a rule."""
    inner_m = programme.inner_m
    total, hall, tiny, number = 0.0, 0.0, 0, 0
    living = kitchen = bath = 0.0
    for (x1, y1, x2, y2), room in cells:
        number += 1
        wide, deep = x2 - x1 - inner_m, y2 - y1 - inner_m
        label = labels[room]
        if room == HALL:
            hall += wide * deep
        if room == HALL or label == STAIRS:
            continue
        short, long, area = min(wide, deep), max(wide, deep), wide * deep
        least, width, aspect = LIMITS[label]
        if short < width or area < least or long > aspect * short:  # R1
            return None
        living += area if label == "Living_Room" else 0.0
        kitchen += area if label == "Kitchen" else 0.0
        bath = max(bath, area if label == "Bathroom" else 0.0)
        tiny += area < _TINY[0] or short < _TINY[1]
        wished = areas_m2[room]
        if wished:
            if area > min(MOST_RATIO * wished, wished + _MOST_MORE_M2) and label != "Storage":  # R2
                return None
            total += abs(math.log(area / wished))
    if kitchen and kitchen < max(_KITCHEN_SHARE * living, bath):  # R4
        return None
    if living and not follows_bedrooms(living, programme.kind, labels):  # R5
        return None
    if tiny > (programme.kind in _MAY_BE_TINY):  # R3
        return None
    enough = _HALL_M2 * max(programme.hall_m / _SLIM_M - 0.2, 1.0) * sum(area > 0 for area in areas_m2)
    total += _HALL_WEIGHT * max(0.0, math.log(hall / enough))
    return total / number


def follows_bedrooms(living_m2: float, kind: str, labels: Iterable[str]) -> bool:
    """Return whether a living room is neither too large for one bedroom nor too small for three (R5)."""
    bedrooms = sum(label in SLEEPING for label in labels) if kind in _ONE_STOREY else 0
    return living_m2 <= _MOST_LIVING_M2 if bedrooms == 1 else bedrooms <= 2 or living_m2 >= _LEAST_LIVING_M2


def keeps_limits(label: str, room: shapely.Polygon) -> bool:
    """Return whether a room that is no rectangle keeps the limits of its label (R1); others than these have none."""
    if label not in LIMITS:
        return True
    x1, y1, x2, y2 = room.bounds
    short, long = sorted((x2 - x1, y2 - y1))
    least, width, aspect = LIMITS[label]
    return bool(room.area >= least and room.area >= width * long and long <= aspect * short)
