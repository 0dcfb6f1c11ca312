import numpy as np
import pytest
import shapely

from pipeline.geometry.areas import OUTSIDE
from pipeline.geometry.bridges import Bridge
from pipeline.geometry.spaces import fit_to_rooms, opening_polygons

ROOMS = [shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3)]


def bridge(x: float, depth: float, sides: tuple[int, int] = (1, 0)) -> Bridge:
    """Across a wall at ``x``, 0.8 m wide; across points left, as along points up."""
    return Bridge(np.array([x, 1.5]), np.array([0.0, 1.0]), 0.8, depth, sides)


def test_a_bridge_reaches_from_face_to_face() -> None:
    for x, depth in ((4.1, 0.3), (4.08, 0.1), (4.12, 0.22)):
        (found,) = fit_to_rooms([bridge(x, depth)], ROOMS)
        assert found.centre == pytest.approx([4.1, 1.5])
        assert found.depth == pytest.approx(0.2)


def test_on_the_outside_it_stays_where_it_was() -> None:
    (found,) = fit_to_rooms([bridge(7.3, 0.14, (OUTSIDE, 1))], ROOMS)
    assert (found.centre[0] - found.depth / 2, found.centre[0] + found.depth / 2) == pytest.approx((7.2, 7.37))


def test_the_opening_lies_between_the_two_faces() -> None:
    (opening,) = opening_polygons([bridge(4.1, 0.2)], ROOMS)
    assert opening.symmetric_difference(shapely.box(4.0, 1.1, 4.2, 1.9)).area < 1e-6


def test_the_opening_follows_faces_that_are_not_parallel() -> None:
    wedge = shapely.Polygon([(4.2, 0), (7.2, 0), (7.2, 3), (4.3, 3)])
    (opening,) = opening_polygons([bridge(4.13, 0.25)], [ROOMS[0], wedge])
    assert opening.area == pytest.approx(0.8 * (0.2 + 0.1 * 0.5), rel=0.01)
    assert opening.touches(wedge) or opening.intersection(wedge).area < 1e-6


def test_a_house_without_passages_needs_no_fitting() -> None:
    assert fit_to_rooms([], ROOMS) == []
    assert opening_polygons([], ROOMS) == []
