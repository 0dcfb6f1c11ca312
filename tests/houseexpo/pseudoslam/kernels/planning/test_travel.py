"""Going along a way on the map: how far a disc may go, when a frontier counts as seen, and what is given up."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from houseexpo.pseudoslam.kernels.collision import disc_is_free, free_distance
from houseexpo.pseudoslam.kernels.episode import POSE
from houseexpo.pseudoslam.kernels.planner_action import update_choices
from houseexpo.pseudoslam.kernels.planning.paths import (
    find_distances,
    free_distance_by_map,
    is_explored_near,
    nearest_reachable_cell,
)
from houseexpo.pseudoslam.kernels.planning.planner_types import ARRIVED, BLOCKED, SEEN, new_planner_memory
from houseexpo.pseudoslam.kernels.types import NO_WAY, new_path_scratch
from houseexpo.pseudoslam.planning import planner_rules
from houseexpo.pseudoslam.step_kernels import enlarge_scratch, make_scratch
from tests.builders.robot_maps import FREE, UNKNOWN, drawn, random_map, random_place
from tests.builders.tries import tries

SEEDS = st.integers(0, 10**6)


@tries(60)
@given(SEEDS)
def test_a_disc_goes_as_far_as_cells_that_are_not_free_let_it(seed: int) -> None:
    """As the true motion does in a house whose walls are all that is not known to be free."""
    known = random_map(seed)
    known[[0, -1]] = known[:, [0, -1]] = 255
    closed = (known != FREE).astype(np.uint8)
    for k in range(20):
        x, y = random_place(known, seed + k)
        heading, distance = 0.7 * k, 0.5 * k
        if disc_is_free(closed, x, y, 0.7):
            given_way = x, y, math.cos(heading), -math.sin(heading), distance, 0.7
            assert free_distance_by_map(known, *given_way) == free_distance(closed, *given_way)


def test_what_a_disc_covers_already_does_not_hold_it_but_the_next_wall_does() -> None:
    known = drawn("##########", "#?.......#", "#........#", "#........#", "##########")
    assert free_distance_by_map(known, 2.2, 2.5, 1.0, 0.0, 3.0, 0.9) == 3.0
    assert free_distance_by_map(known, 2.2, 2.0, 1.0, 0.0, 3.0, 0.9) == 3.0, "it leaves the unknown cell that it covers"
    assert free_distance_by_map(known, 2.5, 2.5, 1.0, 0.0, 30.0, 0.9) == pytest.approx(9.0 - 2.5 - 0.9, abs=1e-5)
    assert free_distance_by_map(known, 4.5, 2.5, 0.0, -1.0, 3.0, 0.9) == pytest.approx(0.6, abs=1e-5)


@tries(40)
@given(SEEDS)
def test_a_frontier_is_seen_where_no_other_is_left_near_it(seed: int) -> None:
    known = random_map(seed, 14, 17)
    rng = np.random.default_rng(seed)
    edges = np.zeros(known.shape, bool)
    for row, col in np.argwhere(known == UNKNOWN).tolist():
        beside = [(row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)]
        edges[row, col] = any(0 <= r < 14 and 0 <= c < 17 and known[r, c] == FREE for r, c in beside)
    for _ in range(20):
        row, col, reach = rng.integers(0, (14, 17, 6)).tolist()
        near = edges[max(row - reach, 0) : row + reach + 1, max(col - reach, 0) : col + reach + 1]
        assert is_explored_near(known, row * 17 + col, reach) == (known[row, col] != UNKNOWN and not near.any())


@tries(40)
@given(SEEDS)
def test_the_nearest_place_is_the_nearest_with_a_way(seed: int) -> None:
    known = random_map(seed)
    memory = new_path_scratch(known.size)
    find_distances(known, *random_place(known, seed), 1.2, -1, memory)
    ways = memory.ways.reshape(known.shape)
    places = np.argwhere((ways >= 0) & (ways != NO_WAY))
    for x, y in np.random.default_rng(seed).uniform(-5, 40, (10, 2)).tolist():
        found = nearest_reachable_cell(memory, x, y)
        if not len(places):
            assert found == -1
            continue
        off = (places[:, 0] + 0.5 - y) ** 2 + (places[:, 1] + 0.5 - x) ** 2
        assert divmod(found, known.shape[1]) == tuple(places[off.argmin()].tolist())


@pytest.mark.parametrize(
    ("outcome", "gone_px", "is_lost"),
    [(ARRIVED, 3.0, True), (SEEN, 3.0, False), (BLOCKED, 3.0, False), (BLOCKED, 0.0, True)],
)
def test_what_was_looked_at_in_vain_is_given_up(outcome: int, gone_px: float, is_lost: bool) -> None:
    """Half a room of 20 x 12 cells is known; the middle of the frontier is (6, 11), the radius 1.2 cells."""
    config = SimulatorConfig(10.0)
    known = np.full((14, 22), 255, np.uint8)
    known[1:-1, 1:-1] = UNKNOWN
    known[1:-1, 1:11] = FREE
    plan, pose = new_planner_memory(4), np.zeros(1, POSE)
    pose["seen_x"], pose["seen_y"] = 4.5, 6.5
    plan.state["goal_x"], plan.state["target"] = math.nan, 6 * 22 + 11
    plan.state["outcome"], plan.state["gone_px"] = outcome, gone_px
    scratch = enlarge_scratch(make_scratch(config), known.size)
    rules = planner_rules(config, PlanningConfig())
    update_choices(known, pose[0], plan, rules, scratch)
    assert plan.state["lost"][0] == int(is_lost)
    cells = sorted(plan.frontiers["cells"].tolist())
    assert cells == ([0, 0, 3, 4] if is_lost else [0, 0, 0, 12])
