"""The ways to rooms: shortest on the grid of blocks, through narrow doors, from everywhere a person can be."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
import shapely

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.kernels.planning.fields import (
    FAR,
    NOWHERE,
    STEPS,
    THERE,
    FlowField,
    find_block_distances,
    find_block_links,
    find_block_spots,
    find_next_blocks,
)
from houseexpo.pseudoslam.worlds.moving_obstacles import make_flow_field
from houseexpo.pseudoslam.worlds.world import make_world, traversable_cells
from tests.builders.simulations import frame_of, plan_of, room


def cluttered(seed: int) -> np.ndarray:
    occupied = room(60, 80)
    rng = np.random.default_rng(seed)
    for _ in range(12):
        row, col = rng.integers(0, (55, 75)).tolist()
        high, wide = rng.integers(1, 15, 2).tolist()
        occupied[row : row + high, col : col + wide] = 1
    return occupied


def blocks_of(occupied: np.ndarray, side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    traversable = traversable_cells(occupied, 2.0)
    shape = -(-occupied.shape[0] // side), -(-occupied.shape[1] // side)
    spots, links = np.empty((*shape, 2), np.int32), np.empty(shape, np.uint8)
    find_block_spots(traversable, side, spots)
    find_block_links(traversable, spots, links)
    return traversable, spots, links


def follow(flow: FlowField, goal: int, block: int) -> list[int]:
    """All blocks on the way from one to a goal."""
    rows, cols, _, _ = flow.sizes[0].item()
    way = [block]
    while flow.toward[goal * rows * cols + way[-1]] != THERE:
        down, right = STEPS[flow.toward[goal * rows * cols + way[-1]]].tolist()
        way.append(way[-1] + down * cols + right)
        assert len(way) <= rows * cols
    return way


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("side", [2, 3])
def test_ways_are_the_shortest(seed: int, side: int) -> None:
    _, spots, links = blocks_of(cluttered(seed), side)
    rows, cols = links.shape
    graph = nx.Graph()
    for i, j in np.argwhere(spots[..., 0] >= 0).tolist():
        graph.add_node(i * cols + j)
        for k, (down, right) in enumerate(STEPS.tolist()):
            if links[i, j] >> k & 1:
                graph.add_edge(i * cols + j, (i + down) * cols + j + right, length=7 if down and right else 5)
    goal = int(np.flatnonzero(spots[..., 0].ravel() >= 0)[7])
    distances, toward = np.empty((rows, cols), np.int32), np.empty((rows, cols), np.uint8)
    find_block_distances(links, goal, distances, np.empty(rows * cols, np.int32), np.empty(rows * cols, np.uint8))
    find_next_blocks(links, distances, toward)
    expected = nx.single_source_dijkstra_path_length(graph, goal, weight="length")
    assert {block: d for block, d in enumerate(distances.ravel().tolist()) if d != FAR} == expected
    for block, length in expected.items():
        if block == goal:
            assert toward.flat[block] == THERE
            continue
        down, right = STEPS[toward.flat[block]].tolist()
        other = block + down * cols + right
        assert graph.has_edge(block, other)
        assert expected[other] + graph.edges[block, other]["length"] == length


def test_links_do_not_lead_through_walls() -> None:
    occupied = room(40, 41)
    occupied[:, 20] = 1
    traversable, spots, links = blocks_of(occupied, 2)
    traversable[occupied == 0] = 1  # both sides, even cells next to the wall
    traversable[:, 19:22] = 0
    find_block_spots(traversable, 2, spots)
    find_block_links(traversable, spots, links)
    distances = np.empty(links.shape, np.int32)
    find_block_distances(links, 25, distances, np.empty(links.size, np.int32), np.empty(links.size, np.uint8))
    assert (distances[1:-1, 1:9] < FAR).all()
    assert (distances[:, 11:] == FAR).all()


@pytest.mark.parametrize("ppm", [10.0, 16.0, 25.0, 33.0])
def test_a_door_a_little_wider_than_a_person_is_a_way(ppm: float) -> None:
    left = [(4, 0), (0, 0), (0, 3), (4, 3), (4, 1.83)]
    right = [(4.1, 1.83), (4.1, 3), (8, 3), (8, 0), (4.1, 0), (4.1, 1.27), (4, 1.27)]
    plan = FloorPlan("two", left + right, 2, {})
    world = make_world(plan.divided, ppm, 0.2, 2.0)
    flow = make_flow_field(world.occupied, world.frame, 0.2, plan.divided)
    rows, cols, _, goals = flow.sizes[0].item()
    assert goals == 2
    here, there = flow.goals.tolist()
    assert follow(flow, 0, there)[-1] == here
    assert follow(flow, 1, here)[-1] == there
    reached = flow.toward.reshape(2, rows, cols) != NOWHERE
    traversable = traversable_cells(world.occupied, 0.2 * ppm)
    cells = np.argwhere(traversable) // flow.sizes[0].block_px
    assert reached[:, cells[:, 0], cells[:, 1]].all()


def test_each_room_has_a_goal_where_it_is_widest(two_rooms: FloorPlan) -> None:
    world = make_world(two_rooms, 25.0, 0.2, 2.0)
    flow = make_flow_field(world.occupied, world.frame, 0.2, two_rooms)
    places = [world.frame.points_from_cells(flow.spots[block]) for block in flow.goals]
    assert len(places) == 2
    assert two_rooms.rooms[1].polygon.centroid.distance(shapely.Point(places[1])) < 0.3


def test_without_rooms_goals_are_far_apart() -> None:
    occupied = room(100, 100)
    flow = make_flow_field(occupied, frame_of(occupied, 10), 0.2, plan_of(occupied, 10, room_num=4))
    places = flow.spots[flow.goals] / 10.0
    assert len(places) == 4
    apart = [np.hypot(*(a - b)) for i, a in enumerate(places) for b in places[:i]]
    assert min(apart) > 6.0


def test_who_fits_nowhere_is_refused() -> None:
    occupied = room(30, 30)
    with pytest.raises(ConfigError, match=r"people.radius_m: people of radius 2 m fit nowhere in plan 'box'"):
        make_flow_field(occupied, frame_of(occupied, 10), 2.0, plan_of(occupied, 10))


def test_in_a_pool_the_arrays_may_be_longer() -> None:
    small, big = (make_flow_field(s, frame_of(s, 10), 0.2, plan_of(s, 10)) for s in (room(30, 30), cluttered(1)))
    pool = FlowField(*(np.zeros((2, *array.shape), array.dtype) for array in big))
    for one, other in zip(pool, small, strict=True):
        one[1, : len(other)] = other
    found = FlowField(*(part[1] for part in pool))
    assert found.sizes.tolist() == small.sizes.tolist()
    assert follow(found, 1, int(small.goals[0])) == follow(small, 1, int(small.goals[0]))
