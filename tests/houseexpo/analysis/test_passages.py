from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely

from houseexpo.analysis.navigability import erode, find_passages, navigability, straighten_walls
from houseexpo.floorplan import decode


def brute(space: shapely.Geometry) -> list[tuple[float, float, float]]:
    """Radius and middle of every passage, one pair of a vertex and a wall after the other."""
    found = set()
    for part in shapely.get_parts(shapely.orient_polygons(space)):
        rings = [shapely.get_coordinates(ring) for ring in (part.exterior, *part.interiors)]
        walls = [shapely.LineString(wall) for ring in rings for wall in pairwise(ring)]
        for corner in np.concatenate([ring[1:] for ring in rings]):
            for wall in walls:
                to = shapely.get_coordinates(shapely.shortest_line(shapely.Point(corner), wall))
                if not np.any(to[1] != to[0]):
                    continue
                middle, radius = to.mean(axis=0), float(np.hypot(*(to[1] - to[0]))) / 2.0
                clear = part.boundary.distance(shapely.Point(middle)) > radius - 1e-9
                if clear and part.contains(shapely.Point(middle)):
                    found.add((round(radius, 5), *np.round(middle, 5).tolist()))
    return sorted(found)


def listed(space: shapely.Geometry, widest_m: float = np.inf) -> list[tuple[float, float, float]]:
    found = find_passages(space, widest_m)
    return sorted({(round(r, 5), *np.round(at, 5).tolist()) for r, at in zip(found.radius, found.middle, strict=True)})


def two_rooms(width: float) -> shapely.Geometry:
    return shapely.union_all([shapely.box(0, 0, 4, 4), shapely.box(4, 1, 5, 1 + width), shapely.box(5, 0, 8, 4)])


@pytest.mark.parametrize(
    "space",
    [
        two_rooms(0.9),
        shapely.box(0, 0, 6, 6) - shapely.box(1.2, 0.5, 4.8, 4.8) - shapely.Point(5.4, 5.4).buffer(0.2, quad_segs=2),
        shapely.union_all([two_rooms(0.7), shapely.box(9, 0, 11, 2)]),
        shapely.box(0, 0, 4, 4) - shapely.Polygon([(0, 2), (2, 1.5), (2, 2.5)]),  # a hole that touches the outline
    ],
    ids=["rooms", "holes", "parts", "touching"],
)
def test_agrees_with_every_pair_looked_at(space):
    assert listed(space) == brute(space)


def stepped(space: shapely.Geometry, radius: float) -> float:
    """The narrowest passage of the biggest piece, by eroding step by step and halving steps; nothing is left out."""
    (piece, *_) = erode(space, radius)

    def count(at: float) -> int:
        return sum(piece.covers(part.representative_point()) for part in erode(space, at))

    low, high = radius, radius + 0.05
    while (parts := count(high)) == 1:
        low, high = high, high + 0.05
    if parts == 0:
        return 2.0 * (radius + shapely.maximum_inscribed_circle(piece, tolerance=0.0025).length)
    while high - low > 0.001:
        middle = (low + high) / 2.0
        low, high = (low, middle) if count(middle) > 1 else (middle, high)
    return low + high


def test_agrees_with_erosion_step_by_step(published_lines):
    for plan in map(decode, published_lines[:60]):
        space = straighten_walls(plan.free_space)
        for radius in (0.1, 0.3):
            found = navigability(plan, (radius,))[f"{radius:.2f}"]
            parts = erode(space, radius)
            assert found.components == len(parts), plan.id
            if parts:
                share = parts[0].area / sum(part.area for part in parts)
                assert found.largest_share == pytest.approx(share, abs=1e-4), plan.id
                assert found.narrowest == pytest.approx(stepped(space, radius), rel=0.01, abs=0.011), plan.id


def test_straightening_keeps_parts_and_holes():
    wall = shapely.box(1, 1, 3, 1.004)  # thinner than what is straightened
    space = shapely.union_all([shapely.box(0, 0, 4, 4) - wall, shapely.box(4.005, 0, 6, 4)])
    found = straighten_walls(space)
    assert found.is_valid
    assert shapely.get_num_geometries(found) == 2
    assert sum(len(part.interiors) for part in found.geoms) == 1


def test_straightening_takes_off_stairs_of_a_centimetre():
    x = np.arange(0.0, 3.0, 0.3)
    stairs = [(at, 0.01 * (k % 2)) for k, at in enumerate(x)]
    space = shapely.Polygon([*stairs, (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)])
    assert len(shapely.get_coordinates(straighten_walls(space))) < 8
