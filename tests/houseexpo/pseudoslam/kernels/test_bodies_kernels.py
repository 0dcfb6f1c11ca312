"""Bodies against slow twins: where they are, how near, what they cover."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely

from houseexpo.pseudoslam.config.moving_obstacles import Trajectory
from houseexpo.pseudoslam.config.obstacles import Circle, Ellipse, Polygon, Rectangle, Shape
from houseexpo.pseudoslam.kernels.body_tracks import distance_to_body, mark_body, track_pose_at
from houseexpo.pseudoslam.kernels.collision import (
    MOVING,
    PERSON,
    Disc,
    cell_meets_disc,
    disc_columns,
    distance_to_people,
    erase_disc,
    mark_disc,
)
from houseexpo.pseudoslam.worlds.moving_obstacles import find_track_cells, make_tracks
from tests.builders.simulations import frame_of, room

PPM = 10.0
SHAPES: list[Shape] = [
    Rectangle(1.2, 0.5),
    Circle(0.4),
    Ellipse(1.4, 0.6),
    Polygon(((-0.5, -0.5), (0.7, -0.4), (0.0, 0.0), (0.6, 0.6), (-0.4, 0.5))),
    Polygon(((0.3, 0.2), (0.9, 0.2), (0.6, 0.8))),  # its place is outside it
]


def outline(shape: Shape, x: float, y: float, heading_deg: float) -> shapely.Geometry:
    """In its place on the grid of ``room(60, 60)``, pixels."""
    if isinstance(shape, (Circle, Ellipse)):
        width, height = (shape.radius_m * 2,) * 2 if isinstance(shape, Circle) else (shape.width_m, shape.height_m)
        local = shapely.affinity.scale(shapely.Point(0, 0).buffer(0.5, quad_segs=90), width, height)
    else:
        local = shapely.Polygon(shape.outline_m)
    turned = shapely.affinity.rotate(local, heading_deg, origin=(0, 0))
    return shapely.transform(turned, lambda p: np.stack([(p[:, 0] + x) * PPM, 60 - (p[:, 1] + y) * PPM], axis=1))


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_a_body_covers_what_its_outline_holds(shape: Shape) -> None:
    occupied = room(60, 60)
    for x, y, heading in ((3.0, 3.0, 0.0), (2.53, 3.31, 37.0), (3.4, 2.2, -120.0)):
        tracks = make_tracks(
            [Trajectory(shape, (0, 1), [(x, y, heading)] * 2)], occupied, frame_of(occupied, PPM), "box"
        )
        expected = outline(shape, x, y, heading)
        drawn = np.zeros_like(occupied)
        mark_body(drawn, tracks, 0, 0.5)
        slack = 0.06 if isinstance(shape, Ellipse) else 1e-6  # pixels; 32 corners stand for an ellipse
        for row, col in itertools.product(range(18, 50), range(10, 50)):
            centre = shapely.Point(col + 0.5, row + 0.5)
            if expected.exterior.distance(centre) > slack:
                assert (drawn[row, col] == MOVING) == expected.contains(centre), (row, col)
            gap = distance_to_body(tracks, 0, 0.5, centre.x, centre.y)
            assert max(gap, 0.0) == pytest.approx(expected.distance(centre), abs=max(slack, 1e-3))


def test_between_poses_it_goes_straight_and_turns_the_short_way() -> None:
    occupied = room(60, 60)
    poses = [(1.0, 1.0, 170.0), (3.0, 2.0, -170.0), (3.0, 4.0, 100.0)]
    tracks = make_tracks([Trajectory(Circle(0.2), (1.0, 3.0, 4.0), poses)], occupied, frame_of(occupied, PPM), "box")
    for clock in np.linspace(-1, 6, 57):
        x, y, heading = track_pose_at(tracks, 0, float(clock))
        assert x == pytest.approx(10 * np.interp(clock, [1, 3, 4], [1, 3, 3]))
        assert y == pytest.approx(60 - 10 * np.interp(clock, [1, 3, 4], [1, 2, 4]))
        assert math.degrees(heading) == pytest.approx(np.interp(clock, [1, 3, 4], [170, 190, 100]))


@pytest.mark.parametrize("thickness", [0.001, 0.05, 0.12])
def test_a_hair_covers_cells_that_hang_together(thickness: float) -> None:
    occupied = room(60, 60)
    for heading in (0.0, 20.0, 45.0, 77.0):
        track = Trajectory(Rectangle(2.0, thickness), (0, 1), [(3.01, 2.97, heading)] * 2)
        drawn = find_track_cells(make_tracks([track], occupied, frame_of(occupied, PPM), "box"), occupied.shape)
        assert drawn[int(60 - 29.7), 30]
        rows, cols = np.nonzero(drawn)
        assert math.hypot(np.ptp(rows) + 1, np.ptp(cols) + 1) >= 19.0
        cells = shapely.union_all(shapely.box(cols - 0.01, rows - 0.01, cols + 1.01, rows + 1.01))
        assert cells.geom_type == "Polygon"


def test_a_disc_covers_the_cells_whose_centres_it_holds() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        x, y, radius = rng.uniform((-2, -2, 0.7), (22, 17, 6))
        drawn = np.ones((15, 20), np.uint8)
        mark_disc(drawn, x, y, radius)
        rows, cols = np.mgrid[:15, :20] + 0.5
        inside = np.hypot(cols - x, rows - y) <= radius
        np.testing.assert_array_equal(drawn, np.where(inside, 3, 1))
        for row in range(15):
            first, end = disc_columns(row, x, y, radius)
            np.testing.assert_array_equal((np.arange(20) >= first) & (np.arange(20) < end), inside[row])
        erase_disc(drawn, x, y, radius)
        assert (drawn == 1).all()


def test_a_cell_meets_a_disc_where_its_square_does() -> None:
    rng = np.random.default_rng(4)
    for _ in range(200):
        x, y, radius = rng.uniform((0, 0, 0.2), (10, 10, 4))
        row, col = rng.integers(0, 10, 2).tolist()
        apart = shapely.box(col, row, col + 1, row + 1).distance(shapely.Point(x, y))
        assert cell_meets_disc(row, col, x, y, radius) == (apart < radius)


def test_the_robot_goes_until_it_touches_a_person() -> None:
    people = np.zeros(2, PERSON)
    people["x"], people["y"] = (20.0, 30.0), 10.0
    robot = Disc(10.0, 10.0, 3.0)
    assert distance_to_people(people, 2.0, robot, 1.0, 0.0, 20.0) == pytest.approx(5.0, abs=1e-8)
    assert distance_to_people(people, 2.0, robot, 1.0, 0.0, 4.0) == 4.0
    assert distance_to_people(people, 2.0, robot, -1.0, 0.0, 20.0) == 20.0
    assert distance_to_people(people, 2.0, robot._replace(y=14.0), 1.0, 0.0, 20.0) == pytest.approx(7.0, abs=1e-8)
    assert distance_to_people(people, 2.0, robot._replace(x=16.0), 1.0, 0.0, 20.0) == 0.0  # it overlaps: only away
    assert distance_to_people(people, 2.0, robot._replace(x=16.0), -1.0, 0.0, 20.0) == 20.0
