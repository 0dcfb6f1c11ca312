"""Configure obstacles that stand still, at given or random poses (section III-E), and the shapes of obstacles."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from houseexpo.configuration import check_above_zero, check_number
from houseexpo.errors import ConfigError
from houseexpo.grids.frame import FloatArray, GridFrame
from houseexpo.pseudoslam.kernels.placement import list_shape_spans
from houseexpo.pseudoslam.kernels.types import Cells

Point: TypeAlias = tuple[float, float]

LARGEST_M = 1000.0
"""The largest size of a shape, metres; a larger one does not fit into any house."""


@dataclass(frozen=True)
class Rectangle:
    """A rectangle around the obstacle's position: ``width_m`` along the heading, ``height_m`` across it."""

    width_m: float
    height_m: float
    is_round: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check_above_zero(self, "rectangle", "width_m", "height_m", at_most=LARGEST_M)

    @property
    def thickness_m(self) -> float:
        """The shorter side."""
        return min(self.width_m, self.height_m)

    @property
    def outline_m(self) -> tuple[Point, ...]:
        """The corners."""
        x, y = self.width_m / 2, self.height_m / 2
        return (-x, -y), (x, -y), (x, y), (-x, y)


@dataclass(frozen=True)
class Ellipse:
    """An ellipse around the obstacle's position with the axes ``width_m`` along the heading and ``height_m`` across."""

    width_m: float
    height_m: float
    is_round: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_above_zero(self, "ellipse", "width_m", "height_m", at_most=LARGEST_M)

    @property
    def thickness_m(self) -> float:
        """The shorter axis."""
        return min(self.width_m, self.height_m)

    @property
    def outline_m(self) -> tuple[Point, ...]:
        """The centre, and an end of each axis."""
        return (0.0, 0.0), (self.width_m / 2, 0.0), (0.0, self.height_m / 2)


@dataclass(frozen=True)
class Circle:
    """A disc around the obstacle's position, with a true radius; the published simulator halves its ``radius``."""

    radius_m: float
    is_round: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_above_zero(self, "circle", "radius_m", at_most=LARGEST_M)

    @property
    def thickness_m(self) -> float:
        """The diameter."""
        return 2 * self.radius_m

    @property
    def outline_m(self) -> tuple[Point, ...]:
        """The centre, and an end of each of two axes."""
        return (0.0, 0.0), (self.radius_m, 0.0), (0.0, self.radius_m)


@dataclass(frozen=True)
class Polygon:
    """A polygon with corners (x, y) relative to the obstacle's position, x along the heading; the ring is not closed.

    If it crosses itself, the even-odd rule decides what is inside.
    """

    points_m: tuple[Point, ...]
    is_round: ClassVar[bool] = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "points_m", _points(self.points_m))
        (x, y), *others = self.points_m
        arms = [(px - x, py - y) for px, py in others]
        if all(ax * by == ay * bx for (ax, ay), (bx, by) in itertools.pairwise(arms)):
            raise ConfigError(f"polygon.points_m: expected an area, found corners on one line: {list(self.points_m)}")

    @property
    def thickness_m(self) -> float:
        """Twice the area divided by the perimeter, which is the width of a long and thin polygon."""
        area = length = 0.0
        before = self.points_m[-1]
        for point in self.points_m:
            area += before[0] * point[1] - before[1] * point[0]
            length += math.dist(before, point)
            before = point
        return abs(area) / length

    @property
    def outline_m(self) -> tuple[Point, ...]:
        """The corners."""
        return self.points_m


Shape: TypeAlias = Rectangle | Ellipse | Circle | Polygon


@dataclass(frozen=True)
class Obstacle:
    """A shape at a position in the plan's metres, with a heading counter-clockwise from x.

    Examples
    --------
    >>> cupboard = Obstacle(Rectangle(1.2, 0.4), x_m=2.0, y_m=1.0, heading_deg=90.0)
    >>> int(cupboard.mask(GridFrame((0.0, 0.0), 10.0, (20, 30))).sum())
    48
    """

    shape: Shape
    x_m: float
    y_m: float
    heading_deg: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.shape, Shape):
            raise ConfigError(f"obstacle.shape: expected a Rectangle, Ellipse, Circle or Polygon, found {self.shape!r}")
        for name in ("x_m", "y_m", "heading_deg"):
            check_number(getattr(self, name), f"obstacle.{name}")

    def outline_px(self, frame: GridFrame) -> FloatArray:
        """Return the shape's ``outline_m`` at its pose, in pixels (n, 2), (across, down)."""
        cos, sin = math.cos(math.radians(self.heading_deg)), math.sin(math.radians(self.heading_deg))
        x, y = self.x_m, self.y_m
        points = ((x + px * cos - py * sin, y + px * sin + py * cos) for px, py in self.shape.outline_m)
        return np.array([frame.pixel_from_point(*point) for point in points])

    def spans(self, frame: GridFrame) -> tuple[Cells, int, bool]:
        """Return the cells as spans of rows, their number, and whether all lie on the grid (``list_shape_spans``)."""
        thickness_px = self.shape.thickness_m * frame.pixels_per_metre
        rows, cols = frame.shape
        found: tuple[Cells, int, bool] = list_shape_spans(
            self.outline_px(frame), self.shape.is_round, thickness_px, rows, cols
        )
        return found

    def mask(self, frame: GridFrame) -> npt.NDArray[np.bool_]:
        """Return the mask of the obstacle (rows, cols): True for cells whose centres lie in it.

        For an obstacle that is thinner than a cell or contains no centre, these are the cells of its outline.
        """
        mask = np.zeros(frame.shape, dtype=bool)
        spans, count, _ = self.spans(frame)
        for row, first, last in spans[:count].tolist():
            mask[row, first:last] = True
        return mask


def _points(value: object) -> tuple[Point, ...]:
    """Return corners as pairs of floats; raise ConfigError for other values, too few corners, or a closed ring."""
    key = "polygon.points_m"
    try:
        points = [(x, y) for x, y in value] if isinstance(value, Iterable) else []
    except (TypeError, ValueError):
        points = []
    if len(points) < 3:
        raise ConfigError(f"{key}: expected at least 3 corners (x, y) in metres, found {value!r}")
    for i, (x, y) in enumerate(points):
        if not (type(x) is type(y) is float and max(abs(x), abs(y)) <= LARGEST_M):  # the common case
            check_number(x, f"{key}[{i}]", at_least=-LARGEST_M, at_most=LARGEST_M)
            check_number(y, f"{key}[{i}]", at_least=-LARGEST_M, at_most=LARGEST_M)
    if points[0] == points[-1]:
        raise ConfigError(
            f"{key}: expected a ring that is not closed, found the first corner again at the end; leave it out"
        )
    return tuple((float(x), float(y)) for x, y in points)


ShapeName = Literal["rectangle", "ellipse", "circle", "polygon"]


@dataclass(frozen=True)
class RandomObstacles:
    """Obstacles that are drawn at random for each episode.

    Parameters
    ----------
    number
        (low, high), the range of the number of obstacles, both inclusive and all equally likely. In a small house there
        may be fewer, but never fewer than ``low``.
    size_m
        (low, high), the range of a uniform distribution, metres: of both sides of a rectangle, both axes of an ellipse,
        the diameter of a circle, and that of the circle around a polygon of 3 to 8 corners.
    shapes
        The kinds of shapes, equally likely.
    gap_m
        Smallest distance between two obstacles, and between an obstacle and a wall, metres, on the grid: between the
        near sides of the cells that they cover, at any resolution. Sensors and collisions know these cells only.
        An ``outline_m`` may reach out of them, as cells are covered by their centres: by less than a
        cell if it has no acute corner, and farther with the tip of a sharp one.
    """

    number: tuple[int, int] = (1, 5)
    size_m: tuple[float, float] = (0.2, 0.8)
    shapes: tuple[ShapeName, ...] = get_args(ShapeName)
    gap_m: float = 0.05

    def __post_init__(self) -> None:
        for name in ("number", "size_m", "shapes"):
            object.__setattr__(self, name, _tuple(getattr(self, name), f"obstacles.random.{name}"))
        _low_and_high(self.number, "obstacles.random.number", at_least=0, at_most=10_000)
        if not all(isinstance(end, int) for end in self.number):
            raise ConfigError(f"obstacles.random.number: expected whole numbers, found {self.number!r}")
        _low_and_high(self.size_m, "obstacles.random.size_m", above=0, at_most=1000)
        check_number(self.gap_m, "obstacles.random.gap_m", at_least=0.0, at_most=10.0)
        strange = [name for name in self.shapes if name not in get_args(ShapeName)]
        if strange or not self.shapes:
            raise ConfigError(
                f"obstacles.random.shapes: expected some of {', '.join(get_args(ShapeName))}; found {self.shapes!r}"
            )

    def draw_shape(self, rng: np.random.Generator) -> Shape:
        """Return a random shape."""
        which, *sizes = rng.random(3).tolist()
        low, high = self.size_m
        width, height = (low + (high - low) * size for size in sizes)
        match self.shapes[int(which * len(self.shapes))]:
            case "rectangle":
                return Rectangle(width, height)
            case "ellipse":
                return Ellipse(width, height)
            case "circle":
                return Circle(width / 2)
            case "polygon":
                return _polygon(width / 2, rng)


@dataclass(frozen=True)
class ObstaclesConfig:
    """Obstacles at given poses, and random ones between them; none by default."""

    placed: tuple[Obstacle, ...] = ()
    random: RandomObstacles | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "placed", _tuple(self.placed, "obstacles.placed"))
        for i, obstacle in enumerate(self.placed):
            if not isinstance(obstacle, Obstacle):
                raise ConfigError(f"obstacles.placed[{i}]: expected an Obstacle, found {obstacle!r}")
        if not isinstance(self.random, (RandomObstacles, type(None))):
            raise ConfigError(f"obstacles.random: expected RandomObstacles or None, found {self.random!r}")


def _polygon(radius_m: float, rng: np.random.Generator) -> Polygon:
    """Draw a polygon in a circle, with corners around the centre at 0.6 to 1 times the radius."""
    corners = int(rng.integers(3, 8, endpoint=True))
    points = []
    for i, (turn, out) in enumerate(rng.random((corners, 2)).tolist()):
        angle, distance = 2 * math.pi * (i + 0.5 * turn) / corners, radius_m * (0.6 + 0.4 * out)
        points.append((distance * math.cos(angle), distance * math.sin(angle)))
    return Polygon(tuple(points))


def _tuple(value: object, key: str) -> tuple[Any, ...]:
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise ConfigError(f"{key}: expected a list, found {value!r}")
    return tuple(value)


def _low_and_high(ends: tuple[float, ...], key: str, **bound: float) -> None:
    if len(ends) != 2:
        raise ConfigError(f"{key}: expected (low, high), found {ends!r}")
    for end in ends:
        check_number(end, key, **bound)
    if ends[0] > ends[1]:
        raise ConfigError(f"{key}: expected (low, high) with low at most high, found {ends!r}")
