"""Doorways of drawn maps: small maps of walls whose doorways are known, in cells of 5 cm."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from pipeline.sources.occupancy_map.drawn_doorways import area_of_cells, find_doorways

CELL_M = 0.05


def house() -> np.ndarray:
    """A room of 100 x 60 cells."""
    free = np.zeros((64, 104), bool)
    free[2:62, 2:102] = True
    return free


def doorways(free: np.ndarray) -> list[list[tuple[float, float]]]:
    return [sorted(map(tuple, corners.tolist())) for corners in find_doorways(free, CELL_M)]


def test_two_ends_of_a_wall_face_each_other() -> None:
    free = house()
    free[:, 40:44] = False
    free[20:38, 40:44] = True
    assert doorways(free) == [[(40.0, 20.0), (40.0, 38.0), (44.0, 20.0), (44.0, 38.0)]]


def test_an_end_faces_the_wall_that_runs_across() -> None:
    free = house()
    free[:44, 40:44] = False
    assert doorways(free) == [[(40.0, 44.0), (40.0, 62.0), (44.0, 44.0), (44.0, 62.0)]]


def test_a_stub_far_from_the_wall_has_no_doorway() -> None:
    free = house()
    free[:10, 40:44] = False
    assert doorways(free) == []


def test_ends_too_far_apart_and_the_side_of_a_pillar_have_none() -> None:
    free = house()
    free[:, 40:44] = False
    free[2:62, 40:44] = True
    free[30:44, 60:74] = False  # thicker than a wall
    assert doorways(free) == []


def test_something_between_two_ends_closes_the_way() -> None:
    free = house()
    free[:, 40:44] = False
    free[15:50, 40:44] = True
    free[30:32, 2:102] = False
    assert doorways(free) == [
        [(40.0, 15.0), (40.0, 30.0), (44.0, 15.0), (44.0, 30.0)],
        [(40.0, 32.0), (40.0, 50.0), (44.0, 32.0), (44.0, 50.0)],
    ]


def test_pillars_have_no_doorways_between_them() -> None:
    free = house()
    for col in (20, 40, 60):
        free[30:36, col : col + 6] = False
    assert doorways(free) == []


@pytest.mark.parametrize("seed", range(5))
def test_the_area_of_cells_is_that_of_their_squares(seed: int) -> None:
    mask = np.random.default_rng(seed).random((12, 17)) < 0.6
    rows, cols = np.nonzero(mask)
    squares = shapely.union_all(shapely.box(cols, -rows - 1, cols + 1, -rows))
    assert area_of_cells(mask).equals(squares)


def test_no_cells_have_no_area_and_no_doorways() -> None:
    nothing = np.zeros((5, 6), bool)
    assert area_of_cells(nothing).is_empty
    assert len(find_doorways(nothing, CELL_M)) == 0
