"""What makes rectangles a home: cut corners, bay windows, slanted walls, pillars at walls. Doors stay free.

R1  An outer corner may be cut off; a long outer wall may have a bay, or stand aslant.
R2  Walls have pilasters and shafts at corners.
R3  Nothing comes near a door, nor shuts a way of 0.9 m.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from pipeline.sources.homes.values import Door

_CLEAR_M = 0.25
_WAY_M = 0.9


@dataclass(frozen=True)
class Details:
    """What is asked for: corners beyond the plain ones, share of oblique walls; thickness of walls."""

    corners: int
    oblique: float
    wall_m: float


def detailed(
    spaces: list[shapely.Polygon], doors: tuple[Door, ...], asked: Details, rng: np.random.Generator
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
    have = sum(shapely.get_num_coordinates(space) - 1 - 4 for space in spaces)
    for _ in range(max(asked.corners - have, 0) // 4):
        spaces = _pilaster(spaces, keep, rng)
    return spaces


def _cut(
    spaces: list[shapely.Polygon],
    keep: shapely.Geometry | None,
    length_m: float,
    wall_m: float,
    rng: np.random.Generator,
) -> tuple[list[shapely.Polygon], float] | None:
    """R1: cut a corner off that no other space touches; return the spaces and the length of the new wall."""
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
        if isinstance(rest, shapely.Polygon) and rest.area > 0.6 * spaces[k].area:
            return [*spaces[:k], rest, *spaces[k + 1 :]], float(np.hypot(*(tips[1] - tips[0])))
    return None


def _pilaster(
    spaces: list[shapely.Polygon], keep: shapely.Geometry | None, rng: np.random.Generator
) -> list[shapely.Polygon]:
    """R2: stand a pillar against a wall or into a corner of a space."""
    areas = np.sqrt([space.area for space in spaces])
    k = int(rng.choice(len(spaces), p=areas / areas.sum()))
    ring = shapely.get_coordinates(shapely.orient_polygons(spaces[k]).exterior)
    steps = np.diff(ring, axis=0)
    lengths = np.hypot(*steps.T)
    side = int(rng.choice(len(lengths), p=lengths / lengths.sum()))
    along = steps[side] / lengths[side]
    across = np.array([-along[1], along[0]])  # into the space
    width, deep = float(rng.uniform(0.15, 0.9)), float(rng.uniform(0.1, 0.6))
    if lengths[side] < width + 0.3:
        return spaces
    draw = rng.random()
    at = (
        0.0
        if draw < 0.3
        else lengths[side] - width
        if draw < 0.6
        else float(rng.uniform(0.15, lengths[side] - width - 0.15))
    )
    start = ring[side] + along * at - across * 0.01
    corners = [start, start + along * width, start + along * width + across * deep, start + across * deep]
    pillar = shapely.Polygon(corners)
    if keep is not None and keep.intersects(pillar):
        return spaces
    rest = shapely.difference(spaces[k], pillar)
    if isinstance(rest, shapely.Polygon) and isinstance(shapely.buffer(rest, -_WAY_M / 2), shapely.Polygon):
        return [*spaces[:k], rest, *spaces[k + 1 :]]
    return spaces
