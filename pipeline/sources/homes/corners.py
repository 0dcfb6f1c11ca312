"""Cut corners off a generated home's rooms and stand pillars in them, until they have about as many corners as asked.

The share of oblique walls is asked for, too. Front doors are placed here as well (``draw_front_doors``).

R1  An outer corner may be cut off, at 45 degrees or along most of a wall, which then stands aslant. Where the number of
    corners that is missing is odd, any corner may lose 0.06 to 0.25 m.
R2  Walls have pilasters, shafts stand at corners, and some walls end in a room.
R3  Nothing comes near a door, nor shuts a way of 0.9 m; a few leave 0.5 m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely

from pipeline.sources.homes.values import HomeDoor, Rect
from pipeline.tolerances import PARTITION_M, RUN_M, SHOULDERS_M

_CLEAR_M, _BESIDE_M = 0.45, 0.05
_WAYS_M = (0.9, 0.5)
"""A pillar leaves the space in one piece for both: the wide way could end where a door opens into a narrow place."""
_NARROW_SHARE: Final = 0.1
"""So many pillars leave the second way only: in some houses the narrowest place is no door."""
_STRAIGHT_M = 0.03
_MIN_OF_PILASTER, _CORNERS_OF_NIB = 2, 4
_IN_CORNER, _NIBS, _REFUSED = 0.5, 0.42, (0.95, 0.75)
_CORNER_WIDE_M, _WIDE_M, _DEEP_M = (0.15, 2.5), (0.15, 0.9), (0.1, 0.6)
_NIB_M = (0.25, 3.0)
_FLANK_M, _BAY_M, _NOSE_M = 1.2, 4.0, 1.5
_CHAMFER_M = (0.06, 0.25)
_SHARPEST_RAD = np.radians(160.0)


@dataclass(frozen=True)
class CornerWishes:
    """What is asked for: corners beyond the plain ones, share of oblique walls; thickness of walls."""

    corners: int
    oblique: float
    wall_m: float


@dataclass(frozen=True)
class _Around:
    """What pillars must keep off, the openings in the walls, and the thickness of walls."""

    keep: shapely.Geometry | None
    opened: shapely.Geometry
    wall_m: float


def add_corners(
    spaces: list[shapely.Polygon], doors: tuple[HomeDoor, ...], asked: CornerWishes, rng: np.random.Generator
) -> list[shapely.Polygon]:
    """Return the spaces with their details."""
    keep = shapely.buffer(shapely.union_all([shapely.box(*door.rect) for door in doors]), _CLEAR_M) if doors else None
    total = float(sum(space.length for space in spaces))
    short = asked.oblique * total
    for _ in range(6):
        if short < 0.3:
            break
        changed = _cut(spaces, keep, short, asked.wall_m, rng)
        if changed is None:
            break
        spaces, length = changed
        short -= length
    missing = asked.corners - _corners(spaces)
    if missing > 0 and missing % 2:
        spaces = _chamfer(spaces, keep, rng)
        missing = asked.corners - _corners(spaces)
    around = _Around(keep, shapely.union_all([shapely.box(*door.rect) for door in doors]), asked.wall_m)
    for _ in range(max(missing, 0)):
        if missing < _MIN_OF_PILASTER:
            break
        spaces, more = _pilaster(spaces, around, missing, rng)
        missing -= more
    return spaces


def _corners(spaces: list[shapely.Polygon]) -> int:
    """Count the corners beyond four a space, without points on straight walls."""
    return int(shapely.get_num_coordinates(shapely.simplify(spaces, _STRAIGHT_M)).sum()) - 5 * len(spaces)


def _bulges(space: shapely.Polygon, opened: shapely.Geometry) -> tuple[int, int]:
    """Count recesses and noses of a space with its doors: short walls whose flanks reach out, or in, by up to 1.2 m."""
    whole = shapely.union(space, shapely.intersection(opened, shapely.buffer(space, _BESIDE_M)))
    (part, *_) = shapely.get_parts(whole)
    ring = shapely.get_coordinates(shapely.simplify(shapely.orient_polygons(part), _STRAIGHT_M).exterior)[:-1]
    step = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(*step.T)
    before = np.roll(step, 1, axis=0)
    left = before[:, 0] * step[:, 1] > before[:, 1] * step[:, 0]  # turns left at an edge's start
    flanks = (np.roll(length, 1) <= _FLANK_M) & (np.roll(length, -1) <= _FLANK_M)
    recess = left & np.roll(left, -1) & ~np.roll(left, 1) & ~np.roll(left, -2)
    nose = ~left & ~np.roll(left, -1) & np.roll(left, 1) & np.roll(left, -2)
    return int((recess & flanks & (length <= _BAY_M)).sum()), int((nose & flanks & (length <= _NOSE_M)).sum())


def _has_spike(space: shapely.Polygon) -> bool:
    """Return whether a ring turns back on itself, so that a wall would have no thickness there."""
    ring = shapely.get_coordinates(space.exterior)[:-1]
    step = np.roll(ring, -1, axis=0) - ring
    before = np.roll(step, 1, axis=0)
    turn = np.arctan2(before[:, 0] * step[:, 1] - before[:, 1] * step[:, 0], (before * step).sum(axis=1))
    return bool(np.abs(turn).max() > _SHARPEST_RAD)


def _draw_length(bounds: tuple[float, float], rng: np.random.Generator) -> float:
    """Draw a length; halves are as likely as doubles."""
    return float(np.exp(rng.uniform(*np.log(bounds))))


def _cut(
    spaces: list[shapely.Polygon],
    keep: shapely.Geometry | None,
    length_m: float,
    wall_m: float,
    rng: np.random.Generator,
) -> tuple[list[shapely.Polygon], float] | None:
    """Cut a corner off that no other space touches; return the spaces and the length of the new wall."""
    corners = [(k, i) for k, space in enumerate(spaces) for i in range(shapely.get_num_coordinates(space.exterior) - 1)]
    for pick in rng.permutation(len(corners)).tolist()[:12]:
        k, i = corners[pick]
        ring = shapely.get_coordinates(shapely.orient_polygons(spaces[k]).exterior)[:-1]
        before, corner, after = ring[i - 1], ring[i], ring[(i + 1) % len(ring)]
        arms = before - corner, after - corner
        lengths = np.hypot(*arms[0]), np.hypot(*arms[1])
        if arms[1][0] * arms[0][1] - arms[1][1] * arms[0][0] <= 0 or min(lengths) < 0.6:
            continue
        leg = float(np.clip(length_m * rng.uniform(0.35, 0.8), 0.3, 0.75 * min(lengths)))
        legs = [leg, leg] if rng.random() < 0.55 else [leg, float(rng.uniform(0.05, 0.9) * lengths[1])]
        tips = [corner + arm / length * each for arm, length, each in zip(arms, lengths, legs, strict=True)]
        piece = shapely.Polygon([tips[0], corner, tips[1]])
        near = shapely.buffer(piece, wall_m * 1.5)
        if keep is not None and keep.intersects(piece):
            continue
        if any(near.intersects(other) for j, other in enumerate(spaces) if j != k):
            continue
        rest = shapely.difference(spaces[k], piece)
        if isinstance(rest, shapely.Polygon) and rest.area > 0.6 * spaces[k].area and not _has_spike(rest):
            return [*spaces[:k], rest, *spaces[k + 1 :]], float(np.hypot(*(tips[1] - tips[0])))
    return None


def _chamfer(
    spaces: list[shapely.Polygon], keep: shapely.Geometry | None, rng: np.random.Generator
) -> list[shapely.Polygon]:
    """Take the edge off one corner: a pipe or a slanted stone stands there."""
    k = int(rng.integers(len(spaces)))
    ring = shapely.get_coordinates(shapely.simplify(shapely.orient_polygons(spaces[k]), 0.0).exterior)[:-1]
    i = int(rng.integers(len(ring)))
    arms = ring[i - 1] - ring[i], ring[(i + 1) % len(ring)] - ring[i]
    lengths = [float(np.hypot(*arm)) for arm in arms]
    leg = float(rng.uniform(*_CHAMFER_M))
    piece = shapely.Polygon(
        [ring[i], *(ring[i] + arm / length * leg for arm, length in zip(arms, lengths, strict=True))]
    )
    if min(lengths) < 2 * leg or (keep is not None and keep.intersects(piece)):
        return spaces
    rest = shapely.difference(spaces[k], piece)
    if not isinstance(rest, shapely.Polygon) or _has_spike(rest):
        return spaces
    return [*spaces[:k], rest, *spaces[k + 1 :]]


def _pilaster(
    spaces: list[shapely.Polygon], around: _Around, missing: int, rng: np.random.Generator
) -> tuple[list[shapely.Polygon], int]:
    """Stand a pillar or a wall's end into a space; also return how many corners it adds.

    Few of those stand that would make a nose, or a recess with another one or with what is beside a door.
    """
    areas = np.sqrt([space.area for space in spaces])
    k = int(rng.choice(len(spaces), p=areas / areas.sum()))
    ring = shapely.get_coordinates(shapely.orient_polygons(spaces[k]).exterior)
    steps = np.diff(ring, axis=0)
    lengths = np.hypot(*steps.T)
    side = int(rng.choice(len(lengths), p=lengths / lengths.sum()))
    along = steps[side] / lengths[side]
    across = np.array([-along[1], along[0]])  # into the space
    kind = float(rng.random()) if missing >= _CORNERS_OF_NIB else 0.0
    in_corner = kind < _IN_CORNER
    if kind > 1.0 - _NIBS:  # a wall that ends in the room
        width, deep = around.wall_m, _draw_length(_NIB_M, rng)
    else:
        width, deep = _draw_length(_CORNER_WIDE_M if in_corner else _WIDE_M, rng), float(rng.uniform(*_DEEP_M))
    at = _draw_position(steps, side, width, in_corner, rng)
    if at is None:
        return spaces, 0
    start = ring[side] + along * at - across * 0.01
    corners = [start, start + along * width, start + along * width + across * deep, start + across * deep]
    pillar = shapely.Polygon(corners)
    if around.keep is not None and around.keep.intersects(pillar):
        return spaces, 0
    rest = shapely.difference(spaces[k], pillar)
    if not isinstance(rest, shapely.Polygon) or rest.interiors or _has_spike(rest):
        return spaces, 0
    ways = _WAYS_M[1:] if rng.random() < _NARROW_SHARE else _WAYS_M
    if all(isinstance(shapely.buffer(rest, -way_m / 2), shapely.Polygon) for way_m in ways):
        more_bulges = np.subtract(_bulges(rest, around.opened), _bulges(spaces[k], around.opened)) > 0
        if (more_bulges & (rng.random(2) < _REFUSED)).any():
            return spaces, 0
        more = _corners([rest]) - _corners([spaces[k]])
        return [*spaces[:k], rest, *spaces[k + 1 :]], more
    return spaces, 0


def _draw_position(
    steps: npt.NDArray[np.float64], side: int, width_m: float, in_corner: bool, rng: np.random.Generator
) -> float | None:
    """Draw where along a side something as wide stands, or None if it has no room, or at the end of a wall."""
    far = float(np.hypot(*steps[side])) - width_m
    if far < RUN_M:
        return None
    if not in_corner:
        return float(rng.uniform(RUN_M / 2, far - RUN_M / 2))
    end = int(rng.integers(2))
    before, after = steps[side - 1 + end], steps[(side + end) % len(steps)]
    return end * far if before[0] * after[1] > before[1] * after[0] else None


# The front door: through an outer wall of the room where people would come in.


_WELCOME: Final = {"Entryway": 4.0, "Lobby": 3.0, "Hall": 2.5, "Hallway": 2.0, "Living_Room": 1.5, "Kitchen": 0.5}
_WIDTH_M: Final = 0.9
_SECOND: Final = 0.25


def draw_front_doors(
    spaces: list[shapely.Polygon], names: tuple[tuple[str, ...], ...], wall_m: float, rng: np.random.Generator
) -> tuple[HomeDoor, ...]:
    """Return a front door, sometimes two; none where no axis-parallel outer wall is long enough."""
    welcome = [_WELCOME.get(each[0] if each else "", 0.0) + float(rng.gumbel()) for each in names]
    wanted = 1 + int(rng.random() < _SECOND)
    found: list[HomeDoor] = []
    for k in np.argsort(welcome)[::-1].tolist():
        others = [space for j, space in enumerate(spaces) if j != k]
        places = [
            rect
            for rect, before in _places(spaces[k], wall_m, rng)
            if all(shapely.box(*rect).distance(other) > wall_m + SHOULDERS_M for other in others)
            and not spaces[k].intersects(shapely.box(*before))  # a wall that ends in the room is no outer one
        ]
        if places:
            found.append(HomeDoor(places[int(rng.integers(len(places)))], (k, None)))
        if len(found) == wanted:
            break
    return tuple(found)


def _places(space: shapely.Polygon, wall_m: float, rng: np.random.Generator) -> list[tuple[Rect, Rect]]:
    """One place on each axis-parallel wall that is long enough, from just inside the room through the wall.

    The second rectangle is what lies before the door, from the middle of the wall on.
    """
    ring = shapely.get_coordinates(shapely.orient_polygons(space).exterior)
    found = []
    for (x1, y1), (x2, y2) in zip(ring[:-1].tolist(), ring[1:].tolist(), strict=True):
        length = abs(x2 - x1) + abs(y2 - y1)
        if min(abs(x2 - x1), abs(y2 - y1)) > 1e-6 or length < _WIDTH_M + 2 * PARTITION_M:
            continue
        at = float(rng.uniform(PARTITION_M, length - PARTITION_M - _WIDTH_M))
        dx, dy = (x2 - x1) / length, (y2 - y1) / length
        a = x1 + dx * at, y1 + dy * at
        b = a[0] + dx * _WIDTH_M + dy * (wall_m + 1e-3), a[1] + dy * _WIDTH_M - dx * (wall_m + 1e-3)
        a = a[0] - dy * 1e-3, a[1] + dx * 1e-3
        c = x1 + dx * at + dy * wall_m / 2, y1 + dy * at - dx * wall_m / 2
        d = c[0] + dx * _WIDTH_M + dy * SHOULDERS_M, c[1] + dy * _WIDTH_M - dx * SHOULDERS_M
        found.append((_rect(a, b), _rect(c, d)))
    return found


def _rect(a: tuple[float, float], b: tuple[float, float]) -> Rect:
    return min(a[0], b[0]), min(a[1], b[1]), max(a[0], b[0]), max(a[1], b[1])
