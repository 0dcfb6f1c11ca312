import numpy as np
import pytest
import shapely

from pipeline.geometry.paths import plan_path, standing_grid

FLOOR = shapely.box(0, 0, 6, 4).difference(shapely.box(3.0, 1.2, 3.2, 4))  # a wall with a gap of 1.2 m below it
RADIUS = 0.2


def test_a_path_keeps_clear_of_walls_and_ends_where_it_was_asked_to() -> None:
    path = plan_path(FLOOR, (1.0, 3.0), (5.0, 3.0), RADIUS, 20)
    assert path is not None
    np.testing.assert_allclose(path[[0, -1]], [(1.0, 3.0), (5.0, 3.0)])
    disc = shapely.linestrings(path).buffer(RADIUS - 0.05)  # to a cell
    assert disc.difference(FLOOR).area < 1e-9
    # round the end of the wall: never shorter than straight lines past it, never longer than octile moves
    straight = 2 * np.hypot(1.8, 2.0)
    length = shapely.linestrings(path).length
    assert straight < length < 1.1 * (straight + 0.6)


@pytest.mark.parametrize(("radius", "fits"), [(0.5, True), (0.7, False)])
def test_a_disc_wider_than_the_passage_finds_no_path(radius: float, fits: bool) -> None:
    path = plan_path(FLOOR, (1.0, 2.0), (5.0, 2.0), radius, 20)
    assert (path is not None) == fits


def test_nobody_walks_through_a_wall_or_from_one_floor_to_another() -> None:
    closed = shapely.MultiPolygon([shapely.box(0, 0, 3, 3), shapely.box(3.1, 0, 6, 3)])
    assert plan_path(closed, (1, 1), (5, 1), RADIUS, 20) is None


def test_a_point_in_a_wall_has_no_path_and_one_at_its_face_starts_beside_it() -> None:
    assert plan_path(FLOOR, (3.1, 3.0), (5.0, 3.0), RADIUS, 20) is None
    path = plan_path(FLOOR, (2.78, 3.0), (1.0, 3.0), RADIUS, 20)
    assert path is not None


def test_no_floor_has_no_path() -> None:
    assert plan_path(shapely.Polygon(), (0, 0), (1, 1), RADIUS, 20) is None
    assert plan_path(shapely.box(0, 0, 0.3, 3), (0.1, 1), (0.1, 2), RADIUS, 20) is None


def test_the_grid_is_the_floor_less_the_radius() -> None:
    grid = standing_grid(FLOOR, RADIUS, 50)
    exact = FLOOR.buffer(-RADIUS).area
    assert grid.free.sum() / 50**2 == pytest.approx(exact, rel=0.01)
