from __future__ import annotations

import math
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
import shapely

from houseexpo.analysis.graph import (
    OUTSIDE,
    distance_matrix,
    open_borders,
    rooms_graph,
    rooms_graph_with_distances,
    shortest_path,
)
from houseexpo.analysis.navigability import disc_centre_areas, navigability
from houseexpo.drawing import svg
from houseexpo.errors import PlanError
from houseexpo.plan import Room


def test_rooms_are_nodes_and_doors_edges(two_rooms):
    graph = rooms_graph(two_rooms)
    assert dict(graph.nodes(data="label")) == {0: "Living_Room", 1: "Unlabelled"}
    assert graph.nodes[1]["area"] == pytest.approx(9.0)
    assert list(graph.edges(keys=True, data="kind")) == [(0, 1, 0, "door")]
    assert graph.edges[0, 1, 0]["width"] == 0.8


def test_entrances_lead_outside_where_asked_for(two_rooms):
    graph = rooms_graph(two_rooms, outside=True)
    assert graph.edges[0, OUTSIDE, 1] == {"kind": "entrance", "width": 0.9}


def test_rooms_that_meet_in_the_open_are_neighbours(two_rooms):
    """The second room is divided at x = 5.7, and a third lies along the lower part of both."""
    rest = (
        Room(1, "Kitchen", ((4.2, 1.1), (5.7, 1.1), (5.7, 3.1), (4.2, 3.1))),
        Room(2, "Hall", ((5.7, 1.1), (7.2, 1.1), (7.2, 3.1), (5.7, 3.1))),
        Room(3, "Hall", ((4.2, 0.1), (7.2, 0.1), (7.2, 1.1), (4.2, 1.1))),
    )
    plan = replace(two_rooms, rooms=(two_rooms.rooms[0], *rest))
    assert [(each.rooms, each.width) for each in open_borders(plan)] == [((1, 2), 2.0), ((1, 3), 1.5), ((2, 3), 1.5)]
    graph = rooms_graph(plan)
    assert nx.number_connected_components(graph) == 1
    assert graph.edges[1, 2, -1] == {"kind": "open", "width": 2.0}
    distances = rooms_graph_with_distances(plan)
    assert distances.edges[1, 2, -1]["distance"] == pytest.approx(1.5)
    assert distances.graph["doors"][0, -1] > 0


def dumbbell(width: float) -> shapely.Geometry:
    """Rooms of 4 x 4 m and 3 x 4 m, a passage of this width and 1 m length between them."""
    passage = shapely.box(3.9, 2 - width / 2, 5.1, 2 + width / 2)
    return shapely.union_all([shapely.box(0, 0, 4, 4), shapely.box(5, 0, 8, 4), passage])


@pytest.mark.parametrize("width", [0.45, 0.62, 0.8, 1.13])
def test_a_passage_is_as_wide_as_it_is(width):
    found = navigability(dumbbell(width), radii=(0.10, 0.20))
    for result in found.values():
        assert result.components == 1
        assert result.largest_share == 1.0
        assert result.narrowest == pytest.approx(width, abs=0.01)


def test_a_passage_too_narrow_for_the_disc_parts_the_space():
    found = navigability(dumbbell(0.5))
    assert found["0.20"].components == 1
    assert found["0.30"].components == 2
    one, other = (4 - 0.6) ** 2, (3 - 0.6) * (4 - 0.6)
    assert found["0.30"].largest_share == pytest.approx(one / (one + other), abs=0.01)
    assert found["0.30"].narrowest == pytest.approx(4.0, abs=0.01)  # the bigger room alone: the widest disc that fits


def test_a_disc_stands_in_what_is_left_of_the_free_space(two_rooms):
    pieces = disc_centre_areas(two_rooms.free_space, 0.2)
    assert len(pieces) == 1
    assert pieces[0].area == pytest.approx(two_rooms.free_space.buffer(-0.2).area, rel=0.005)


def test_a_room_that_crosses_itself_is_named_and_still_drawn(two_rooms):
    first, *others = two_rooms.rooms
    crossed = (first.ring[1], first.ring[0], *first.ring[2:])
    plan = replace(two_rooms, rooms=(replace(first, ring=crossed), *others))
    with pytest.raises(PlanError, match=r"rooms\[0\]\.polygon: expected a simple ring, found Self-intersection"):
        plan.graph()
    assert "</svg>" in svg(plan)


# The shortest way between two places, against lengths that can be written down.


L = shapely.Polygon([(0, 0), (6, 0), (6, 6), (3, 6), (3, 3), (0, 3)])


def test_a_way_turns_at_the_corner() -> None:
    found = shortest_path(L, (0, 2.5), (3.5, 6))
    assert found is not None
    assert found.points.tolist() == [[0, 2.5], [3, 3], [3.5, 6]]
    assert found.length == pytest.approx(2 * math.hypot(3, 0.5))


def test_a_hole_is_passed_on_the_shorter_side() -> None:
    space = shapely.box(0, 0, 10, 10).difference(shapely.box(4, 2, 6, 9))
    found = shortest_path(space, (3, 5), (7, 5))
    assert found is not None
    assert found.length == pytest.approx(2 + 2 * math.hypot(1, 3))
    assert found.points[:, 1].min() == 2


def test_it_is_as_long_as_the_walking_distance() -> None:
    rng = np.random.default_rng(3)
    blocks = shapely.union_all([shapely.box(x, y, x + 0.8, y + 0.5) for x, y in rng.uniform(0.5, 9, (25, 2))])
    space = shapely.box(0, 0, 10, 10).difference(blocks)
    space = max(shapely.get_parts(space), key=shapely.area)
    inside = [p for p in rng.uniform(0, 10, (60, 2)) if space.contains(shapely.Point(p))][:12]
    expected = distance_matrix(space, inside)
    for i, one in enumerate(inside):
        for j, other in enumerate(inside):
            found = shortest_path(space, one, other)
            assert found is not None
            assert found.length == pytest.approx(expected[i, j], abs=1e-9)
            lengths = np.hypot(*np.diff(found.points, axis=0).T)
            assert found.length == pytest.approx(lengths.sum(), abs=1e-9)
