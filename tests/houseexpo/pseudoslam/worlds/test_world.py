from __future__ import annotations

import itertools

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.floorplan import decode
from houseexpo.pseudoslam.kernels.collision import disc_is_free
from houseexpo.pseudoslam.worlds.world import make_world, traversable_cells


def square(side: float, plan_id: str = "square") -> FloorPlan:
    return FloorPlan(plan_id, [(0.1, 0.1), (0.1, 0.1 + side), (0.1 + side, 0.1 + side), (0.1 + side, 0.1)], 1, {})


def test_an_empty_room_is_all_in_sight() -> None:
    world = make_world(square(4.0), 25.0, 0.2, 5.0)
    assert world.occupied.shape == (102, 102)
    assert world.occupied[[0, -1]].all()
    assert world.occupied[:, [0, -1]].all()
    assert world.observable_cells == 100 * 100
    assert world.traversable.sum() == 90 * 90  # 0.2 m are five cells; a centre half a cell from the wall is nearer


def test_row_0_lies_at_the_highest_y() -> None:
    plan = FloorPlan("ell", [(0, 0), (0, 4), (1, 4), (1, 2), (3, 2), (3, 0)], 1, {})
    world = make_world(plan, 10.0, 0.2, 5.0)
    assert world.occupied[5, 5] == 0
    assert world.occupied[5, 25] == 1
    assert world.occupied[35, 25] == 0


def test_a_pocket_that_the_robot_cannot_reach_is_no_place_to_start() -> None:
    """The published simulator starts there too, and such an episode cannot end well."""
    left, door = (
        [(0, 0), (0, 4), (4, 4), (4, 2.2)],
        [(4.2, 2.2), (4.2, 4), (6, 4), (6, 0), (4.2, 0), (4.2, 1.9), (4, 1.9)],
    )
    plan = FloorPlan("slit", [*left, *door, (4, 0)], 1, {})
    world = make_world(plan, 20.0, 0.2, 5.0)
    cols = np.argwhere(world.traversable)[:, 1]
    assert cols.max() < 4.0 * 20
    seen = world.observable[:, int(4.3 * 20) :]
    assert 0 < seen.sum() < (world.occupied[:, int(4.3 * 20) :] == 0).sum()  # through the slit some is seen, not all


def test_standing_cells_are_where_the_disc_is_free(published_lines: list[bytes]) -> None:
    world = make_world(decode(published_lines[0]), 10.0, 0.2, 3.0)
    free = np.zeros_like(world.occupied)
    for row, col in itertools.product(*map(range, free.shape)):
        free[row, col] = disc_is_free(world.occupied, col + 0.5, row + 0.5, 2.0)
    assert (world.traversable <= free).all()
    assert world.traversable.sum() > 0.9 * free.sum()


def test_starts_reach_the_whole_house(published_lines: list[bytes]) -> None:
    """The published simulator starts only in 10 to 80% of the box."""
    far = 0
    for line in published_lines[:8]:
        world = make_world(decode(line), 16.0, 0.2, 5.0)
        cols = np.argwhere(world.traversable)[:, 1]
        far += bool((cols > 0.85 * world.occupied.shape[1]).any())
        assert (world.observable <= 1 - world.occupied).all()
        assert (world.traversable <= world.observable).all()
    assert far == 8


def test_walls_survive_at_a_coarse_grid() -> None:
    """The published simulator shrinks a picture, and a wall of 0.1 m has gaps or is gone at 16 px/m."""
    for x in np.arange(2.0, 2.1, 0.01).round(2).tolist():
        verts = [(0, 0), (0, 3), (x, 3), (x, 0.9), (x + 0.1, 0.9), (x + 0.1, 3), (4, 3), (4, 0)]
        world = make_world(FloorPlan("wall", verts, 1, {}), 16.0, 0.2, 5.0)
        assert world.occupied[1:34, 30:38].any(axis=1).all()
        assert world.occupied[1:34, 30:38].sum(axis=1).max() <= 2


def test_what_cannot_be_used_is_named() -> None:
    with pytest.raises(ConfigError, match=r"robot.radius_m: a robot of radius 3 m fits nowhere in plan 'square'"):
        make_world(square(4.0), 25.0, 3.0, 5.0)
    with pytest.raises(ConfigError, match=r"pixels_per_metre: 20000 makes 6.4e\+09 cells of plan 'square'"):
        make_world(square(4.0), 20000.0, 0.2, 5.0)


def test_a_disc_that_touches_fits() -> None:
    occupied = np.ones((7, 9), np.uint8)
    occupied[1:6, 1:8] = 0
    assert traversable_cells(occupied, 2.5).nonzero()[1].tolist() == [3, 4, 5]
    assert not traversable_cells(occupied, 2.6).any()
