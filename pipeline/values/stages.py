"""What the stages hand to each other; all shapes are plan areas in the level frame, metres."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.closers import Closer
from pipeline.geometry.doorways import Doorway
from pipeline.geometry.overlay import EMPTY


@dataclass(frozen=True, eq=False)
class Evidence:
    """Stage ``evidence``: what stands in a level and what it is, as plan areas.

    ``walls`` stand from the floor to head height (``tall``), or end at a window or at a sloped roof. ``lintels`` hang
    over free floor; ``rails`` are thin and end below head height; ``furniture`` is all else that stands. ``leaves`` are
    the doors' leaves wherever they stand, ``doorways`` where doors are known to be. ``floor`` is the source's, or None;
    ``low`` is where a roof hangs too low to stand under, ``slight`` what hangs from the ceiling by a hand's breadth,
    ``lower`` what of the walls ends below the ceiling (a garden's wall, a partition).
    ``names`` are plan points (x, y) with the source's words. ``heights`` are those of the cuts, metres.
    """

    walls: BaseGeometry
    tall: BaseGeometry
    lintels: BaseGeometry
    rails: BaseGeometry
    furniture: BaseGeometry
    doorways: tuple[Doorway, ...] = ()
    leaves: tuple[Polygon, ...] = ()
    floor: BaseGeometry | None = None
    low: BaseGeometry = EMPTY
    slight: BaseGeometry = EMPTY
    lower: BaseGeometry = EMPTY
    names: tuple[tuple[tuple[float, float], str], ...] = ()
    heights: Mapping[str, float | list[float]] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Planes:
    """Stage ``planes``: what stands at the door plane, and what closes its gaps at other heights.

    ``door`` is P_d. ``low`` (sills), ``high`` (lintels), ``rails`` and ``doorways`` (known doors) are disjoint from it.
    ``tall`` is the part of P_d that stands from the floor to above a person's head, the known doors closed.
    ``leaves`` are where door leaves stand.
    """

    door: BaseGeometry
    low: BaseGeometry
    high: BaseGeometry
    rails: BaseGeometry
    tall: BaseGeometry
    heights: Mapping[str, float | list[float]]
    doorways: tuple[Doorway, ...] = ()
    leaves: tuple[Polygon, ...] = ()


@dataclass(frozen=True, eq=False)
class Layout:
    """Stage ``layout``: the closed plane, its pieces, and the spaces it closes (largest first).

    The ``sides`` of a closer's bridge are indices into ``rooms``, or OUTSIDE. Closers of kind "room_edge",
    "floor_edge" and "wall_ends" are the boundary that an open house was given.
    """

    door: BaseGeometry
    ground: BaseGeometry
    closers: tuple[Closer, ...]
    rooms: tuple[Polygon, ...]


@dataclass(frozen=True, eq=False)
class NamedRoom:
    """A room with its labels (of the 25) and the source's own words."""

    polygon: Polygon
    labels: tuple[str, ...] = ()
    words: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A piece of furniture: its footprint in the level frame, its height in metres, and the source's word for it."""

    polygon: Polygon
    height_m: float
    word: str
