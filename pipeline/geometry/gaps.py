"""Gaps of full height: where a wall ends and goes on, or meets another, after a step of free floor.

Two planes never differ in such a gap, so it is found from the walls' ends: an end is a short edge of the wall's
outline between two right angles; the gap is what lies between it and the wall that it points at.

R1  Where that is the end of another wall, the gap is a hole in one wall. The two walls may stand a little aside of
    each other, as those drawn by hand do.
R2  Where it is a wall that crosses, the gap has the width of a door at most, or every wall that juts into a corridor
    would part it in two. Where a leaf hangs at the end, it may be as wide as a double door.
R3  A nib, too short to be told from a pilaster, is the end of a wall where another end or nib faces it in line.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.outlines import Outlines, outlines
from pipeline.geometry.overlay import overlap, polygons_of

THICKEST_M = 0.6
SQUARE = np.sin(np.deg2rad(25.0))
LONGER = 2.0
"""A wall is at least this many times longer than thick; less is a pillar or a piece of furniture."""
NIB_M = 0.04
"""Beside a corner a wall may end as soon as this, seen from one side; from the other it is long."""
DOOR_M = 1.25
"""The widest gap between the end of a wall and one that crosses."""
DOUBLE_DOOR_M = 1.5
"""The widest such gap where a leaf hangs at the end."""
LEAST_OVERLAP = 0.3
"""Two ends overlap if they do so by this share of the thinner wall; else the gap is as deep as both walls."""
ASIDE_M = 0.1
"""Two ends of one wall stand no farther aside of each other than this, seen along the wall."""
ALIKE = 0.5
OPPOSITE = 0.9
IN_LINE_M = 0.03
HINGE_M = 0.1
DETAIL_M = 0.002
LAP_M = 0.01
BEFORE_M = 0.01  # so close before an end nothing stands, for a crack of twice this is closed already


@dataclass(frozen=True, eq=False)
class WallEnd:
    """The short edge ``a`` to ``b`` (2,) at the end of a wall, and the unit vector ``out`` that points on from it.

    ``is_nib`` is True where it juts from a wall by less than a wall does that ends.
    """

    a: npt.NDArray[np.float64]
    b: npt.NDArray[np.float64]
    out: npt.NDArray[np.float64]
    is_nib: bool = False

    @property
    def centre(self) -> npt.NDArray[np.float64]:
        """The middle of the edge."""
        return np.asarray((self.a + self.b) / 2)

    def faces(self, other: WallEnd) -> bool:
        """Whether two ends look at each other in one line, as those of one wall do."""
        aside = np.array([-self.out[1], self.out[0]])
        width, other_width = (np.hypot(*(end.b - end.a)) for end in (self, other))
        beside = abs((other.centre - self.centre) @ aside)
        return bool(other.out @ self.out < -OPPOSITE and max(abs(width - other_width), beside) < IN_LINE_M)


def wall_ends(walls: BaseGeometry, *, nibs: bool = False) -> Iterator[WallEnd]:
    """Every free end of a straight wall; with ``nibs`` those that are told from pilasters by what they face only."""
    parts = polygons_of(walls)
    if parts:
        yield from (end for end in _ends_of(outlines(parts, DETAIL_M)) if nibs or not end.is_nib)


def _ends_of(walls: Outlines) -> Iterator[WallEnd]:
    """All that looks like an end, ring by ring."""
    points, after, before = walls.points, walls.after, walls.before
    edge = points[after] - points
    length = np.hypot(*edge.T)
    unit = edge / length[:, None]
    came = unit[before]
    turn = came[:, 0] * unit[:, 1] - came[:, 1] * unit[:, 0]
    square = turn > np.cos(np.arcsin(SQUARE))  # a left turn of about 90 degrees: convex, the wall on the left
    end = square & square[after] & (length <= THICKEST_M) & (np.minimum(length[before], length[after]) >= NIB_M)
    long = np.maximum(length[before], length[after]) >= LONGER * length
    juts = (turn[before] < 0) | (turn[after[after]] < 0)  # from a wall; a pillar stands free
    for k in np.flatnonzero(end & (long | juts)):
        out = np.array([unit[k, 1], -unit[k, 0]])
        yield WallEnd(points[k], points[after[k]], out, is_nib=not long[k])


def gap_at(end: WallEnd, walls: BaseGeometry, reach_m: float) -> Polygon | None:
    """The rectangle from a wall's end to the wall it points at, or None if none stands within ``reach_m``."""
    aside = np.array([-end.out[1], end.out[0]]) * 0.01
    inner = (end.a + aside, end.b - aside) if (end.b - end.a) @ aside > 0 else (end.a - aside, end.b + aside)
    far = []
    for point in (*inner, (end.a + end.b) / 2):  # the other wall may stand a little aside
        ray = shapely.linestrings([point + 1e-3 * end.out, point + reach_m * end.out])
        hit = shapely.intersection(ray, walls)
        if not hit.is_empty:
            far.append(float(np.min((shapely.get_coordinates(hit) - point) @ end.out)))
    if not far:
        return None
    step = end.out * (max(far) + 0.01)  # a little into the wall that it meets, so that they touch
    back = end.out * -0.005
    return Polygon([end.a + back, end.b + back, end.b + step, end.a + step])


def gaps(
    tall: BaseGeometry, standing: Sequence[BaseGeometry], reach_m: float, leaves: Sequence[Polygon] = ()
) -> list[Polygon]:
    """Fillings of all gaps of full height up to ``reach_m`` metres, shortest first.

    Parameters
    ----------
    tall
        Walls that stand from the floor to above head height; a gap lies between two of them.
    standing
        All that closes the plane; a gap that it fills already is none.
    leaves
        The leaves of doors, wherever they stand.
    """
    ends = list(wall_ends(tall, nibs=True))
    if not ends:
        return []
    before = shapely.points([end.centre + BEFORE_M * end.out for end in ends])
    taken = set(shapely.STRtree(standing).query(before, predicate="intersects")[0].tolist())
    hinges = set(shapely.STRtree(leaves).query(before, predicate="dwithin", distance=HINGE_M)[0].tolist())
    found: list[Polygon] = []
    for k, end in enumerate(ends):
        if k in taken:
            continue
        gap = gap_at(end, tall, reach_m)
        facing = _between_ends(gap or _lane(end, reach_m), end, ends, reach_m)
        widest = DOUBLE_DOOR_M if k in hinges else DOOR_M
        if facing is not None:  # R1
            found.append(facing)
        elif gap is not None and _width(gap, end) <= widest and not end.is_nib:  # R2
            found.append(gap)
    return _each_once(sorted(found, key=lambda g: (round(g.length, 6), g.bounds)))


def _each_once(found: list[Polygon]) -> list[Polygon]:
    """A gap between two ends is found from both; the first stands for what lies mostly in it."""
    kept: list[Polygon] = []
    for gap in found:
        if not any(overlap(gap, other).area > ALIKE * min(gap.area, other.area) for other in kept):
            kept.append(gap)
    return kept


def _width(gap: Polygon, end: WallEnd) -> float:
    return float(np.ptp(shapely.get_coordinates(gap) @ end.out))


def _lane(end: WallEnd, reach_m: float) -> Polygon:
    """The strip before a wall's end where nothing stands in its line."""
    return Polygon([end.a, end.b, end.b + reach_m * end.out, end.a + reach_m * end.out])


def _between_ends(gap: Polygon, end: WallEnd, ends: list[WallEnd], reach_m: float) -> Polygon | None:
    """The gap from a wall's end to that of one that comes the other way, or None if another wall crosses (R1, R3)."""
    near = shapely.buffer(gap, ASIDE_M, cap_style="square", join_style="mitre")
    found = []
    for other in ends:
        if other.out @ end.out >= -OPPOSITE:
            continue
        if not shapely.intersects(near, shapely.linestrings([other.a, other.b])):
            continue
        away = (other.centre - end.centre) @ end.out
        if not 0 < away <= reach_m + LAP_M:
            continue
        sure = end.faces(other) or not (end.is_nib or other.is_nib)  # R3
        if sure and (strip := _strip(end, other)) is not None:
            found.append(strip)
    return min(found, key=lambda strip: strip.length, default=None)


def _strip(end: WallEnd, other: WallEnd) -> Polygon | None:
    """The filling between two ends: where they overlap, or all that lies between them; None if they are apart (R1)."""
    aside = np.array([-end.out[1], end.out[0]])
    (a, b), (c, d) = (np.sort([side @ aside for side in (each.a, each.b)]) for each in (end, other))
    low, high = max(a, c), min(b, d)
    if low - high > ASIDE_M:
        return None
    if high - low < LEAST_OVERLAP * min(b - a, d - c):
        low, high = min(a, c), max(b, d)
    start = min(end.a @ end.out, end.b @ end.out) - 0.005
    stop = max(other.a @ end.out, other.b @ end.out) + 0.01
    corners = [(start, low), (stop, low), (stop, high), (start, high)]
    return Polygon([step * end.out + side * aside for step, side in corners])
