"""Define what stages pass on, from Evidence to Obstacle; shapes are plan areas in the level frame, metres."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import EMPTY
from pipeline.geometry.openings import Opening


@dataclass(frozen=True, eq=False)
class Evidence:
    """Result of the stage ``evidence``: the contents of a level by kind, as plan areas.

    ``walls`` reach from the floor to head height (``tall``), or to a window or a sloped roof. ``lintels`` hang over
    free floor. ``rails`` are thin and end below head height. ``furniture`` is everything else that stands on the floor.
    ``leaves`` are door leaves, open or closed; ``doorways`` are the places of known doors. ``floor`` is the source's or
    None. ``low_headroom`` is where a roof is too low to stand under. ``shallow_headers`` hang from the ceiling by a
    hand's breadth only. ``partial_height``
    are parts of the walls that end below the ceiling (a garden's wall, a partition). ``heights`` are those of the
    sections, metres. ``scanned`` is True for a point cloud and the mesh of a scan. ``open_edge`` is where such a scan
    ends and nothing stands; it lies along the walls, disjoint from them, and closes what they leave open.
    """

    walls: BaseGeometry
    tall: BaseGeometry
    lintels: BaseGeometry
    rails: BaseGeometry
    furniture: BaseGeometry
    doorways: tuple[Opening, ...] = ()
    leaves: tuple[Polygon, ...] = ()
    floor: BaseGeometry | None = None
    low_headroom: BaseGeometry = EMPTY
    shallow_headers: BaseGeometry = EMPTY
    partial_height: BaseGeometry = EMPTY
    heights: Mapping[str, float | list[float]] = field(default_factory=dict)
    scanned: bool = False
    open_edge: BaseGeometry = EMPTY


@dataclass(frozen=True, eq=False)
class Planes:
    """Result of the stage ``planes``: the door plane, and what closes its gaps at other heights.

    ``door`` is P_d. ``sills``, ``lintels``, ``rails`` and ``doorways`` (known doors) are disjoint from it.
    ``tall`` is the part of P_d that reaches from the floor to above a person's head, with known doors closed.
    ``leaves`` are the areas of door leaves.
    """

    door: BaseGeometry
    sills: BaseGeometry
    lintels: BaseGeometry
    rails: BaseGeometry
    tall: BaseGeometry
    heights: Mapping[str, float | list[float]]
    doorways: tuple[Opening, ...] = ()
    leaves: tuple[Polygon, ...] = ()


@dataclass(frozen=True, eq=False)
class Layout:
    """Result of the stage ``layout``: the closed plane, its pieces, and the spaces that it encloses, largest first.

    The ``sides`` of a candidate are indices into ``rooms``, or OUTSIDE. What is ``closed_by`` "room_edge",
    "floor_edge" or "wall_ends" closes an open house. ``spaces`` are the rooms and all other spaces between the walls,
    before one of them was found to be no room; the ``ways``, the candidates of that moment, have indices
    into these.
    """

    door: BaseGeometry
    ground: BaseGeometry
    candidates: tuple[Opening, ...]
    rooms: tuple[Polygon, ...]
    spaces: tuple[Polygon, ...] = ()
    ways: tuple[Opening, ...] = ()


@dataclass(frozen=True, eq=False)
class NamedRoom:
    """A room with its labels (of the 25), the source's own words, and the probability that its outline is right."""

    polygon: Polygon
    labels: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    confidence: float | None = None


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A piece of furniture: its footprint in the level frame, its height in metres, and the source's word for it."""

    polygon: Polygon
    height_m: float
    word: str
