"""The obstacles in the house (section III-E)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.checks import number
from houseexpo.pseudoslam.config.shapes import Circle, Ellipse, Obstacle, Polygon, Rectangle, Shape

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
        Smallest distance between two obstacles, and between an obstacle and a wall, metres.
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
        number(self.gap_m, "obstacles.random.gap_m", at_least=0.0, at_most=10.0)
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
        number(end, key, **bound)
    if ends[0] > ends[1]:
        raise ConfigError(f"{key}: expected (low, high) with low at most high, found {ends!r}")
