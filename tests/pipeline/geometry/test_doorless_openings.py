"""Where two drawn rooms meet between the ends of a wall."""

import numpy as np
import pytest
import shapely
from shapely import Polygon, affinity

from pipeline.geometry.wall_gaps import find_doorless_openings

OUTER = shapely.difference(shapely.box(-0.2, -0.2, 8.2, 4.2), shapely.box(0, 0, 8, 4))


def inner(*spans: tuple[float, float], thick: float = 0.2) -> Polygon:
    """The outer walls and a wall in the middle that stands between these y."""
    half = thick / 2
    return shapely.union_all([OUTER, *(shapely.box(4 - half, low, 4 + half, high) for low, high in spans)])


def rooms(apart: float) -> list[Polygon]:
    return [shapely.box(0, 0, 4 - apart / 2, 4), shapely.box(4 + apart / 2, 0, 8, 4)]


@pytest.mark.parametrize("apart", [0.0, 0.2])
@pytest.mark.parametrize("turn", [0.0, 33.0])
def test_rooms_meet_between_two_wall_ends(apart: float, turn: float) -> None:
    walls = affinity.rotate(inner((0.0, 1.0), (3.0, 4.0)), turn, origin=(0, 0))
    drawn = [affinity.rotate(room, turn, origin=(0, 0)) for room in rooms(apart)]
    (border,) = find_doorless_openings(drawn, shapely.difference(shapely.convex_hull(walls), walls), walls)
    middle = affinity.rotate(shapely.Point(4, 2), turn, origin=(0, 0))
    assert border.centre == pytest.approx((middle.x, middle.y), abs=1e-6)
    assert border.width == pytest.approx(2.0, abs=1e-6)
    assert border.strip().area == pytest.approx(2.0 * apart, abs=1e-6)
    assert abs(np.dot(border.along, border.across)) < 1e-12


def test_a_wall_on_one_side_is_enough() -> None:
    walls = inner((1.5, 4.0))
    (border,) = find_doorless_openings(rooms(0.0), shapely.box(0, 0, 8, 4).difference(walls), walls)
    assert border.width == pytest.approx(1.5)


@pytest.mark.parametrize(
    "spans",
    [
        (),  # no wall between the rooms: one space that the source divides
        ((0.0, 4.0),),  # closed
        ((0.0, 1.75), (2.25, 4.0)),  # too narrow to walk through
    ],
)
@pytest.mark.parametrize("apart", [0.0, 0.2])
def test_there_is_none_without_a_wall_or_without_a_way(spans: tuple[tuple[float, float], ...], apart: float) -> None:
    walls = inner(*spans)
    assert not find_doorless_openings(rooms(apart), shapely.box(0, 0, 8, 4).difference(walls), walls)


def test_rooms_far_apart_do_not_meet() -> None:
    walls = inner((0.0, 1.0), (3.0, 4.0), thick=1.0)
    assert not find_doorless_openings(rooms(1.0), shapely.box(0, 0, 8, 4).difference(walls), walls)
