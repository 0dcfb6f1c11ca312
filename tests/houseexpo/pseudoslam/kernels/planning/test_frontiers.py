"""Where the map of a robot ends in free space, and where it goes to see on, against slow twins."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.planning import frontiers, paths
from houseexpo.pseudoslam.kernels.planning.frontiers import line_is_free
from houseexpo.pseudoslam.planning import MapPlanner
from tests.builders.robot_maps import (
    FREE,
    drawn,
    random_map,
    random_place,
    slow_by_mean,
    slow_clear,
    slow_clusters,
    slow_standing,
    slow_ways,
)
from tests.builders.tries import tries

SEEDS = st.integers(0, 10**6)
CONFIG = SimulatorConfig(10.0, robot=RobotConfig(radius_m=0.12), laser=LaserConfig(range_m=2.0))
RADIUS, RANGE = 1.2, 20.0
SHORT = SimulatorConfig(10.0, robot=RobotConfig(radius_m=0.12), laser=LaserConfig(range_m=0.6))


def slow_goal(known: np.ndarray, ways: np.ndarray, middle: tuple[int, int]) -> tuple[int, int] | None:
    """R3 for cells within 1 m: the nearest with a way and a clear line; of the first 32 that have a way."""
    rows, cols = np.nonzero((ways >= 0) & np.isfinite(ways))
    off = (rows - middle[0]) ** 2 + (cols - middle[1]) ** 2
    places = sorted(zip(off.tolist(), (rows - middle[0]).tolist(), (cols - middle[1]).tolist(), strict=True))
    for squared, down, right in places[:32]:
        if squared <= 100 and slow_clear(known, middle, (middle[0] + down, middle[1] + right)):
            return middle[0] + down, middle[1] + right
    return None


@tries(40)
@given(SEEDS)
def test_they_are_what_their_twins_say(seed: int) -> None:
    """Clusters, sizes, middles, ways and order; goals near by; the others' are seen by a line that may graze."""
    known = random_map(seed)
    x, y = random_place(known, seed)
    ways = slow_ways(slow_standing(known, x, y, RADIUS), x, y, RADIUS)
    config = CONFIG if seed % 2 else SHORT
    reach = 20 if seed % 2 else 6
    found = MapPlanner(config).frontiers(known, x, y)
    cols = known.shape[1]
    told = {divmod(int(one.middle), cols): one for one in found}
    assert len(told) == len(found)
    clusters = slow_clusters(known, reach)
    assert set(told) <= {cell for cluster in clusters for cell in cluster}
    for cluster in clusters:
        middle = next((cell for cell in cluster if cell in told), None)
        if middle is None:
            assert all(slow_goal(known, ways, cell) is None for cell in cluster)
            continue
        one = told[middle]
        place = divmod(int(one.goal), cols)
        inner = slow_by_mean(cluster)
        unseen = inner[: inner.index(middle)]
        assert all(slow_goal(known, ways, cell) is None for cell in unseen), "none nearer to the mean is seen"
        assert slow_goal(known, ways, middle) in (place, None)
        assert one.cells == len(cluster)
        assert one.way == ways[place]
        assert math.dist(place, middle) <= RANGE
    keys = [(one.cells < 4, one.way, one.middle) for one in found]
    assert keys == sorted(keys)


@tries(100)
@given(SEEDS)
def test_a_line_is_clear_where_its_twin_says_so(seed: int) -> None:
    known = random_map(seed, 9, 11)
    rng = np.random.default_rng(seed)
    for _ in range(30):
        row, col, to_row, to_col = rng.integers(0, (9, 11, 9, 11)).tolist()
        assert line_is_free(known, row, col, to_row, to_col) == slow_clear(known, (row, col), (to_row, to_col))


def half_known(wall: str = "#") -> np.ndarray:
    """A room of 20 x 12 cells; the robot has seen its left half."""
    known = np.full((14, 22), 255, np.uint8)
    known[1:-1, 1:-1] = 0
    known[1:-1, 1:11] = FREE
    return known


def test_the_edge_of_half_a_room_is_one_frontier() -> None:
    known = half_known()
    found = MapPlanner(CONFIG).frontiers(known, 3.5, 6.5)
    assert len(found) == 1
    one = found[0]
    assert one.cells == 12
    assert divmod(int(one.middle), 22) == (6, 11)
    assert divmod(int(one.goal), 22) == (6, 9), "a radius of 1.2 cells off the unknown"
    assert one.way == 6 * 70


def test_what_is_given_up_is_none_and_the_rest_is() -> None:
    """Within the radius of 1.2 cells."""
    known = half_known()
    planner = MapPlanner(CONFIG)
    found = planner.frontiers(known, 3.5, 6.5, [6 * 22 + 11])
    assert sorted(found["cells"].tolist()) == [4, 5]  # rows 1 to 4 and 8 to 12
    column = [row * 22 + 11 for row in range(1, 13)]
    assert len(planner.frontiers(known, 3.5, 6.5, column)) == 0


def test_specks_come_after_long_edges_and_can_be_left_out() -> None:
    known = half_known()
    known[3, 3] = 0
    found = MapPlanner(CONFIG).frontiers(known, 3.5, 8.5)
    assert found["cells"].tolist() == [12, 1]
    assert found["way"][1] < found["way"][0]
    assert MapPlanner(CONFIG, least_m=0.3).frontiers(known, 3.5, 8.5)["cells"].tolist() == [12]
    assert MapPlanner(CONFIG, most=1).frontiers(known, 3.5, 8.5)["cells"].tolist() == [12]


def test_through_a_gap_that_the_robot_cannot_pass_it_looks() -> None:
    """The middle of what lies behind the gap is (3, 12); the lines that end there lead from below, past (5, 10)."""
    known = drawn(
        "####################",
        "#.........#????????#",
        "#.........#????????#",
        "#.........#????????#",
        "#.............?????#",
        "#.........#????????#",
        "#.........#????????#",
        "#.........#????????#",
        "####################",
    )
    found = MapPlanner(CONFIG).frontiers(known, 2.5, 2.5)
    cols = known.shape[1]
    assert [(divmod(int(one.middle), cols), int(one.cells)) for one in found] == [((3, 12), 7)]
    row, col = divmod(int(found["goal"][0]), cols)
    assert row > 4
    assert col < 9


def test_beside_a_beam_through_a_door_it_looks_at_what_it_sees() -> None:
    """The mean of the cells beside the beam lies behind the wall, where nothing sees it; those in the door are seen."""
    known = drawn(
        "############",
        "#.....##????",
        "#......?????",
        "#......?????",
        "#.......????",
        "#.....##.???",
        "#.....##.???",
        "#.....##.???",
        "#.....##?.??",
        "#.....##?.??",
        "#.....##?.??",
        "#.....##??.?",
        "#.....##??.?",
        "#.....##??.?",
        "############",
    )
    cluster = slow_clusters(known)
    assert len(cluster) == 1
    middle = slow_by_mean(cluster[0])[0]
    assert middle[0] >= 8
    found = MapPlanner(CONFIG).frontiers(known, 2.5, 2.5)
    assert found["cells"].tolist() == [len(cluster[0])]
    row, _ = divmod(int(found["middle"][0]), known.shape[1])
    assert row < middle[0]


def test_functions_within_are_compiled_once_and_not_again_for_constants() -> None:
    test_the_edge_of_half_a_room_is_one_frontier()
    for kernel in (frontiers._viewpoint, frontiers._nearest, paths.distance_at):
        assert len(getattr(kernel, "signatures", [])) <= 1, kernel  # none where their caller came from disk


def test_the_most_that_are_asked_for_are_the_first_of_all() -> None:
    for seed in range(20):
        known = random_map(seed)
        x, y = random_place(known, seed)
        every = MapPlanner(CONFIG).frontiers(known, x, y).copy()
        for most in (1, 2, 5):
            assert MapPlanner(CONFIG, most=most).frontiers(known, x, y).tolist() == every[:most].tolist()


def test_the_planner_tells_ways_and_paths() -> None:
    known = half_known()
    planner = MapPlanner(CONFIG)
    found = planner.frontiers(known, 3.5, 6.5)
    goal = int(found["goal"][0])
    path = planner.path(goal)
    assert path.tolist() == [6 * 22 + col for col in range(3, 10)]
    assert planner.metres(planner.ways.ravel()[path]).tolist() == pytest.approx([0.1 * k for k in range(7)])
    planner.find_distances(known, 3.5, 6.5, until=goal)
    assert planner.ways.ravel()[goal] == 6 * 70
    assert len(planner.path(0)) == 0
