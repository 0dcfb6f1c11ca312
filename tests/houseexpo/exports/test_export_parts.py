"""Trapezoids, slits, and what stands in a plan."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from houseexpo import decode
from houseexpo.errors import ConfigError
from houseexpo.exports import published_json, sdf
from houseexpo.exports.polygons import cut_into_trapezoids, join_holes_by_slits
from houseexpo.exports.worlds_2d import start_and_goal
from tests.builders.tries import tries


@tries(60)
@given(
    st.lists(st.tuples(*[st.integers(0, 12)] * 2, *[st.integers(1, 6)] * 2, st.integers(0, 3)), min_size=1, max_size=7)
)
def test_trapezoids_are_the_polygon(parts):
    turned = [shapely.affinity.rotate(shapely.box(x, y, x + w, y + h), 15 * turn) for x, y, w, h, turn in parts]
    for polygon in shapely.get_parts(shapely.set_precision(shapely.union_all(turned), 1e-4)):
        pieces = [shapely.Polygon(ring) for ring in cut_into_trapezoids(polygon)]
        assert sum(piece.area for piece in pieces) == pytest.approx(polygon.area, rel=1e-4)
        assert shapely.symmetric_difference(shapely.union_all(pieces), polygon).area < 1e-3
        assert all(piece.exterior.is_ccw and piece.convex_hull.area - piece.area < 1e-9 for piece in pieces)


def test_slits_take_the_shortest_way_and_keep_out_of_doors():
    room = shapely.box(0, 0, 5, 3).difference(shapely.box(1, 0.5, 1.5, 1.0))
    joined = join_holes_by_slits(room)
    assert joined.area == pytest.approx(room.area - 0.01 * 0.5)
    assert shapely.difference(room, joined).bounds[3] == pytest.approx(0.5)
    kept = join_holes_by_slits(room, [shapely.box(0.5, 0, 2, 0.4)])
    assert kept.area == pytest.approx(room.area - 0.01 * 1.0)
    assert shapely.difference(room, kept).bounds[0] == 0.0


def test_slits_between_holes_leave_what_was_connected_connected():
    rng = np.random.default_rng(3)
    corners = rng.choice(81, 14, replace=False)
    pillars = [shapely.Point(1.0 + c % 9, 1.0 + c // 9).buffer(rng.uniform(0.1, 0.4), quad_segs=4) for c in corners]
    room = shapely.transform(shapely.box(0, 0, 10, 10).difference(shapely.union_all(pillars)), lambda p: p.round(2))
    joined = join_holes_by_slits(room)
    assert joined.geom_type == "Polygon"
    assert joined.is_valid
    assert not joined.interiors
    assert room.area - joined.area < 0.01 * 14 * 2
    points = shapely.get_coordinates(joined)
    assert np.allclose(points, points.round(2))


def test_published_json_slits_or_drops(flat):
    slit, drop = (json.loads(published_json(flat, holes=h)[f"{flat.id}.json"]) for h in ("slit", "drop"))
    assert np.array_equal(drop["verts"], flat.verts)
    back = decode(json.dumps(slit))
    assert back.bbox == flat.bbox
    assert shapely.LinearRing(back.verts).is_simple
    assert not shapely.LinearRing(back.verts).is_ccw
    assert not back.free_space.contains(shapely.Point(1.2, 1.2))
    assert flat.area - 0.02 < back.area < flat.area
    doors = [door.polygon for door in flat.doors if door.kind != "entrance"]
    assert all(back.free_space.covers(door.buffer(-1e-6)) for door in doors)
    with pytest.raises(ConfigError, match="expected 'slit' or 'drop', found 'fill'"):
        published_json(flat, holes="fill")


@pytest.mark.parametrize("heights", [(2.0, 2.1), (2.5, 0.0), (float("nan"), 2.0), (2.5, float("nan"))])
def test_heights_that_make_no_house(flat, heights):
    with pytest.raises(ConfigError, match="0 < door_height <= wall_height"):
        sdf(flat, wall_height=heights[0], door_height=heights[1])


def test_a_robot_starts_where_it_can_stand(flat):
    start, goal = start_and_goal(flat.free_space)
    standing = flat.free_space.buffer(-0.19)
    assert standing.covers(shapely.MultiPoint([start, goal]))
    assert np.hypot(*np.subtract(start, goal)) > 3
    narrow = shapely.box(0, 0, 5, 0.2)
    assert start_and_goal(narrow) == ((2.5, 0.1), (2.5, 0.1))
