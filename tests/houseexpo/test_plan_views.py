"""What a plan computes when it is asked: walls, grids, graph, distances."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
import shapely

from houseexpo.analysis.graph import distance_matrix
from houseexpo.analysis.navigability import navigability
from houseexpo.errors import ConfigError, PlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.raster import NOTHING
from houseexpo.plan import Navigability


def test_walls_enclose_the_free_space(two_rooms):
    walls = two_rooms.walls(0.2)
    together = shapely.union_all(walls)
    assert together.area == pytest.approx(sum(wall.area for wall in walls))
    assert together.intersection(two_rooms.free_space).area == pytest.approx(0)
    assert together.area == pytest.approx(7.5 * 3.4 - 7.1 * 3.0 + 2 * 1.1 * 0.1 + 0.16 - 0.02, abs=0.03)
    assert any(wall.equals(shapely.box(1.0, 1.0, 1.4, 1.4)) for wall in walls)  # the pillar, whole
    door = two_rooms.doors[0].polygon
    assert together.intersection(door).area == pytest.approx(0)


def test_no_wall_stands_along_a_slit_between_two_buildings():
    outline = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (6.0, 1.0), (6.0, 0.0), (9.0, 0.0), (9.0, 3.0), (6.0, 3.0)]
    plan = FloorPlan("apart", [*outline, (6.0, 1.01), (3.0, 1.01), (3.0, 3.0), (0.0, 3.0)], 2, {})
    assert sorted(wall.bounds for wall in plan.walls(0.1)) == [
        pytest.approx((-0.1, -0.1, 3.1, 3.1)),
        pytest.approx((5.9, -0.1, 9.1, 3.1)),
    ]


@pytest.mark.parametrize("thickness", [0, -0.1, float("nan"), float("inf")])
def test_walls_have_a_thickness(two_rooms, thickness):
    with pytest.raises(ConfigError, match="thickness"):
        two_rooms.walls(thickness)


def test_grid_is_occupancy(two_rooms):
    grid = two_rooms.grid(20)
    assert grid.dtype == np.uint8
    assert set(np.unique(grid)) == {0, 1}
    assert (grid == 0).sum() / 400 == pytest.approx(two_rooms.area, rel=0.005)
    assert grid[[0, -1]].all()
    assert grid[:, [0, -1]].all()


def test_grids_share_their_frame(two_rooms):
    grid, rooms, doors = two_rooms.grid(20), two_rooms.room_grid(20), two_rooms.door_grid(20)
    frame = two_rooms.grid_frame(20)
    assert grid.shape == rooms.shape == doors.shape
    assert not grid[rooms >= 0].any()
    assert set(np.unique(rooms)) == {NOTHING, 0, 1}
    assert grid[tuple(frame.cells_from_points((1.2, 1.2)))] == 1  # the pillar
    assert doors[tuple(frame.cells_from_points((4.15, 1.5)))] == 0


def test_distance_field_is_metres_to_the_wall():
    square = FloorPlan("square", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {})
    field = square.distance_field(50)
    assert field.max() == pytest.approx(1.0, abs=0.02)
    assert field[tuple(square.grid_frame(50).cells_from_points((0.5, 1.0)))] == pytest.approx(0.5, abs=0.02)
    assert field[0, 0] == 0


def test_graph_has_walking_distances(two_rooms):
    graph = two_rooms.graph()
    assert graph.nodes[1]["position"] == pytest.approx((5.7, 1.6))
    # from the first room's middle past the pillar's corner to the door, and on to the second's
    (one, other), door = (graph.nodes[i]["position"] for i in (0, 1)), (4.15, 1.5)
    straight = np.hypot(one[0] - door[0], one[1] - door[1]) + np.hypot(other[0] - door[0], other[1] - door[1])
    assert graph.edges[0, 1, 0]["distance"] == pytest.approx(straight, abs=0.01)
    assert graph.graph["doors"][0, 1] == pytest.approx(np.hypot(4.1, 0.05), abs=1e-3)
    assert "outside" in two_rooms.graph(outside=True)


def test_walking_distances_turn_at_corners():
    ell = shapely.Polygon([(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)])
    found = distance_matrix(ell, [(4, 0.5), (0.5, 4), (0.5, 0.5)])
    assert found[0, 1] == pytest.approx(2 * np.hypot(3, 0.5), abs=0.02)
    assert found[0, 2] == pytest.approx(3.5)
    assert (np.diag(found) == 0).all()
    apart = shapely.union_all([shapely.box(0, 0, 1, 1), shapely.box(2, 0, 3, 1)])
    assert np.isinf(distance_matrix(apart, [(0.5, 0.5), (2.5, 0.5)])[0, 1])


def test_navigability_is_what_is_recorded_and_what_is_measured(two_rooms):
    recorded = replace(two_rooms, navigability={"0.20": Navigability(7, 0.5, 0.3)})
    assert recorded.navigability(0.2) == Navigability(7, 0.5, 0.3)
    assert recorded.navigability(0.25).components == 1
    assert recorded.navigability(0.45).components == 2
    assert recorded.navigability["0.20"].components == 7
    assert pickle.loads(pickle.dumps(recorded)) == recorded  # noqa: S301 - our own bytes
    assert not FloorPlan("x", two_rooms.verts, 1, {}).navigability
    with pytest.raises(PlanError, match="radius"):
        recorded.navigability(-1)
    with pytest.raises(PlanError, match="found inf"):
        recorded.navigability(float("inf"))
    with pytest.raises(PlanError, match=r"found -0\.1"):
        navigability(two_rooms, (0.2, -0.1))
