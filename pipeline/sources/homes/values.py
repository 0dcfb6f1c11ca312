"""Hold what is asked of a generated home (``HomeWish``), and its parts. Metres, x right, y up, as in the level frame.

Rooms are inner polygons, from wall face to wall face, joined by openings. Walls are what lies between and around.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import shapely

Rect: TypeAlias = tuple[float, float, float, float]
"""x1, y1, x2, y2."""


def snap_wall_line(value_m: float, wall_m: float) -> float:
    """Return where the centre line of a wall is when its faces lie on the 1 cm grid of plans, or a line as it is asked.

    Widths then come out of the pipeline as they were made.
    """
    return round(value_m - wall_m / 2, 2) + wall_m / 2


@dataclass(frozen=True)
class HomeWish:
    """What is asked of one home, drawn from the published statistics.

    ``spaces`` are what walls and doors part; ``rooms`` are counted by name and may share a space, ``labels`` name
    them. ``nameless`` spaces carry no label. ``corners`` are those beyond four a space and four a door, fewer
    where walls run on past a door; ``oblique`` is the share of the walls' length that is not axis-parallel. ``areas``
    are those of the spaces, ``names`` their labels, the first one being what the space is. ``doors`` are clear widths,
    metres, ascending.
    """

    spaces: int
    rooms: int
    area_m2: float
    long_m: float
    short_m: float
    corners: int
    oblique: float
    wall_m: float
    doors: tuple[float, ...]
    names: tuple[tuple[str, ...], ...]
    areas_m2: tuple[float, ...]


@dataclass(frozen=True)
class HomeDoor:
    """A doorway through a wall: its freed area, and the two spaces that it joins; a front door leads outside, None."""

    rect: Rect
    spaces: tuple[int, int | None]


@dataclass(frozen=True)
class NamedBox:
    """A room as a source names it; ``label`` None for a room without a name."""

    label: str | None
    box: Rect


@dataclass(frozen=True, eq=False)
class Home:
    """One storey: ``spaces`` as inner polygons, walls of ``wall_m`` between and around them.

    ``room_count`` counts the rooms as a source does, those without a box too.
    """

    id: str
    spaces: tuple[shapely.Polygon, ...]
    doors: tuple[HomeDoor, ...]
    fronts: tuple[HomeDoor, ...]
    boxes: tuple[NamedBox, ...]
    room_count: int
    wall_m: float
