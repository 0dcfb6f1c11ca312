"""The cells of a shape: by their centres, and nothing vanishes."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import fill_cells
from houseexpo.pseudoslam.config.obstacles import Circle, Ellipse, Obstacle, Polygon, Rectangle, Shape

FRAME = GridFrame((-1.0, 0.5), 10.0, (40, 50), y_up=True)
STAR = Polygon(((0.0, 1.0), (-0.25, 0.2), (-1.0, 0.0), (-0.2, -0.25), (0.1, -1.1), (0.3, -0.2), (0.9, 0.3)))
FAT: list[Shape] = [Rectangle(1.3, 0.4), Ellipse(1.5, 0.5), Circle(0.6), STAR]
THIN: list[Shape] = [Rectangle(2.0, 0.01), Ellipse(1.7, 0.002), Polygon(((-1, 0), (1, 0.04), (1, 0.0))), Circle(0.01)]


def placed(obstacle: Obstacle) -> shapely.Polygon:
    """The shape in its place, metres; a round one of many corners."""
    shape = obstacle.shape
    if isinstance(shape, Circle):
        local = shapely.Point(0, 0).buffer(shape.radius_m, quad_segs=500)
    elif isinstance(shape, Ellipse):
        local = shapely.affinity.scale(
            shapely.Point(0, 0).buffer(0.5, quad_segs=500), shape.width_m, shape.height_m, origin=(0, 0)
        )
    else:
        local = shapely.Polygon(shape.outline_m)
    turned = shapely.affinity.rotate(local, obstacle.heading_deg, origin=(0, 0))
    return shapely.affinity.translate(turned, obstacle.x_m, obstacle.y_m)


def by_centres(obstacle: Obstacle, frame: GridFrame) -> np.ndarray:
    """One cell at a time: even-odd, for rings; the equation, for ellipses."""
    mask = np.zeros(frame.shape, bool)
    cos, sin = math.cos(math.radians(obstacle.heading_deg)), math.sin(math.radians(obstacle.heading_deg))
    shape = obstacle.shape
    for cell in itertools.product(*map(range, frame.shape)):
        x, y = frame.points_from_cells(cell) - (obstacle.x_m, obstacle.y_m)
        ahead, left = x * cos + y * sin, y * cos - x * sin
        if isinstance(shape, (Circle, Ellipse)):
            width, height = (
                (2 * shape.radius_m, 2 * shape.radius_m)
                if isinstance(shape, Circle)
                else (shape.width_m, shape.height_m)
            )
            mask[cell] = (2 * ahead / width) ** 2 + (2 * left / height) ** 2 < 1
        else:
            for (x1, y1), (x2, y2) in itertools.pairwise([*shape.outline_m, shape.outline_m[0]]):
                if (y1 > left) != (y2 > left) and ahead < x1 + (left - y1) / (y2 - y1) * (x2 - x1):
                    mask[cell] ^= True
    return mask


@pytest.mark.parametrize("y_up", [False, True])
@pytest.mark.parametrize("shape", FAT, ids=lambda shape: type(shape).__name__)
def test_a_shape_covers_the_cells_whose_centres_lie_in_it(shape: Shape, y_up: bool) -> None:
    frame = GridFrame((-1.0, 0.5), 10.0, (40, 50), y_up)
    for x_m, y_m, heading in ((1.234, 2.345, 0.0), (1.5, 2.5, 33.0), (0.777, 1.9, -100.0)):
        obstacle = Obstacle(shape, x_m, y_m, heading)
        mask = obstacle.mask(frame)
        assert mask.sum() > 20
        np.testing.assert_array_equal(mask, by_centres(obstacle, frame))


@pytest.mark.parametrize("shape", [Rectangle(1.3, 0.4), STAR], ids=lambda shape: type(shape).__name__)
def test_rings_are_filled_as_plans_are(shape: Shape) -> None:
    obstacle = Obstacle(shape, 1.234, 2.345, 17.0)
    mask = np.zeros(FRAME.shape, bool)
    fill_cells(mask, placed(obstacle), FRAME, 1)
    np.testing.assert_array_equal(obstacle.mask(FRAME), mask)


def test_what_a_ring_encloses_twice_is_outside() -> None:
    bow_tie = Obstacle(Polygon(((-0.8, -0.6), (0.8, 0.6), (0.8, -0.6), (-0.8, 0.6))), 1.234, 2.345)
    expected, mask = by_centres(bow_tie, FRAME), bow_tie.mask(FRAME)
    assert (mask >= expected).all()
    top, bottom = FRAME.cells_from_points(((1.234, 2.345 + 0.4), (1.234, 2.345 - 0.4))).tolist()
    assert not mask[tuple(top)]
    assert not mask[tuple(bottom)]


@pytest.mark.parametrize("heading", [0.0, 20.0, 45.0, 90.0, 131.0])
@pytest.mark.parametrize("shape", THIN, ids=lambda shape: type(shape).__name__)
def test_what_is_thinner_than_a_cell_covers_all_cells_it_crosses(shape: Shape, heading: float) -> None:
    obstacle = Obstacle(shape, 1.234, 2.346, heading)
    whole, expected = placed(obstacle), np.zeros(FRAME.shape, bool)
    for row, col in itertools.product(*map(range, FRAME.shape)):
        x, y = FRAME.points_from_pixels((col, row + 1))
        crossed = shapely.box(x, y, x + 0.1, y + 0.1).intersection(whole)
        expected[row, col] = crossed.length > 0.01  # more than a corner of the cell
    mask = obstacle.mask(FRAME)
    assert mask.any()
    assert (mask >= expected).all()
    assert mask.sum() <= expected.sum() + 2


def test_a_speck_covers_the_cell_it_lies_in() -> None:
    for shape in (Circle(1e-4), Rectangle(0.06, 0.06), Polygon(((0, 0), (1e-3, 0), (0, 1e-3)))):
        mask = Obstacle(shape, 1.21, 2.31).mask(FRAME)
        row, col = FRAME.cells_from_points((1.21, 2.31))
        assert mask[row, col]


def test_neighbours_that_share_a_side_share_no_cell() -> None:
    """Sides on the 1 cm grid run through centres."""
    frame = GridFrame((0.0, 0.0), 25.0, (60, 60), y_up=True)
    one, other = Obstacle(Rectangle(0.6, 0.5), 0.5, 1.0), Obstacle(Rectangle(0.42, 0.5), 1.01, 1.0)
    masks = one.mask(frame), other.mask(frame)
    assert not (masks[0] & masks[1]).any()
    both = Obstacle(Rectangle(1.02, 0.5), 0.71, 1.0).mask(frame)
    np.testing.assert_array_equal(masks[0] | masks[1], both)


def test_a_thin_one_along_a_wall_takes_no_cell_of_it() -> None:
    frame = GridFrame((0.0, 0.0), 10.0, (20, 20), y_up=True)
    for x_m, side in ((0.51, 5), (0.49, 4)):  # on either side of x = 0.5
        mask = Obstacle(Rectangle(0.02, 0.8), x_m, 1.0).mask(frame)
        assert set(mask.nonzero()[1].tolist()) == {side}


def test_what_lies_off_the_grid_is_left_out() -> None:
    half = Obstacle(Circle(0.5), -1.0, 2.5)
    assert half.mask(FRAME).sum() == pytest.approx(math.pi * 25 / 2, rel=0.1)
    assert not half.spans(FRAME)[2]
    for far in (1e3, -1e3, 1e300):
        for shape in (*FAT, *THIN):
            assert not Obstacle(shape, far, far).mask(FRAME).any()
    assert Obstacle(Rectangle(1e3, 1e3), 0, 0).mask(FRAME).all()


def test_headings_turn_counter_clockwise() -> None:
    mask = Obstacle(Rectangle(2.0, 0.2), 1.0, 2.0, 45.0).mask(FRAME)
    rows, cols = mask.nonzero()
    assert cols[rows.argmin()] > cols[rows.argmax()]  # row 0 lies at the highest y
    assert mask.sum() == pytest.approx(40, abs=4)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Rectangle(0.0, 1.0), r"rectangle.width_m: expected more than 0, found 0.0"),
        (lambda: Ellipse(1.0, math.nan), r"ellipse.height_m: expected a finite number, found nan"),
        (lambda: Circle("wide"), r"circle.radius_m: expected a finite number, found 'wide'"),
        (lambda: Polygon(((0, 0), (1, 0))), r"polygon.points_m: expected at least 3 corners"),
        (lambda: Polygon(3), r"polygon.points_m: expected at least 3 corners \(x, y\) in metres, found 3"),
        (lambda: Polygon(((0, 0), (1, 0), (1, 2, 3))), r"polygon.points_m: expected at least 3 corners"),
        (lambda: Polygon(((0, 0), (1, 0), (1, math.inf))), r"polygon.points_m\[2\]: expected a finite number"),
        (lambda: Polygon(((0, 0), (1, 1), (2, 2))), r"expected an area, found corners on one line"),
        (lambda: Polygon(((0, 0), (1, 0), (1, 1), (0, 0))), r"found the first corner again at the end"),
        (lambda: Obstacle("box", 0, 0), r"obstacle.shape: expected a Rectangle, .* found 'box'"),
        (lambda: Obstacle(Circle(1), 0, math.inf), r"obstacle.y_m: expected a finite number, found inf"),
    ],
)
def test_what_is_no_shape_is_refused(make: object, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        make()  # type: ignore[operator]


def test_points_may_be_lists() -> None:
    polygon = Polygon([[0, 0], [1, 0], [0, 1]])
    assert polygon == Polygon(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)))
    assert hash(polygon)
