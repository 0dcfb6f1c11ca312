"""Define the frozen values that sources pass to stages (``Level``), and stages to each other.

The meshes of a Level are in the level frame: metres, x right and y up in the plan, z height above the level's floor
(for SUNCG: above the foot of the wall meshes). ``Level.frame`` maps (x, y) of the level frame to the source's plan
axes. Shapes of stages are plan areas in the level frame, metres. Values that geometry works on (meshes, openings,
spaces) are its own and are named here too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.corrections import Correction
from houseexpo.plan import Frame
from pipeline.geometry.areas import EMPTY, unite
from pipeline.geometry.meshes import Mesh
from pipeline.geometry.openings import Opening
from pipeline.geometry.rooms_and_passages import JoinedPoints, Spaces
from pipeline.rejection import Rejection

__all__ = [
    "CUT_OFF",
    "EDGE",
    "IDLE",
    "KEPT_FROM",
    "MADE",
    "Evidence",
    "FloorObstacle",
    "Input",
    "JoinedPoints",
    "Layout",
    "Level",
    "Mesh",
    "NamedRoom",
    "Opening",
    "Planes",
    "Reader",
    "RejectedLevel",
    "SourceObject",
    "SourceRoom",
    "Spaces",
]

EDGE: Final = "edge"
"""Among the guesses: nothing in the source ends the rooms."""
IDLE: Final = "without_effect"
"""The key of a provenance for what a person has said of a file or a section and what does nothing here."""
KEPT_FROM: Final = "kept_from"
"""The key of a provenance for the reason for which the house would have been rejected if a person had not kept it."""
CUT_OFF: Final = "cut walls"
"""Among the guesses: the walls are cut off low, and the reader has drawn them up to the usual height of a storey."""


@dataclass(frozen=True, eq=False)
class SourceRoom:
    """A room that the source names: its words, our labels for them, and its plan polygon or box if it is known.

    ``words`` may be empty (a room without a name), or several. ``polygon`` is exact if the source has the geometry of
    the room (IfcSpace), otherwise None. ``box`` (x1, y1, x2, y2) covers the room and possibly more (SUNCG).
    Both are in the level frame.
    """

    words: tuple[str, ...]
    labels: tuple[str, ...]
    polygon: Polygon | None = None
    box: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class SourceObject:
    """An object that the source separates from the walls, with the source's words; triangles in the level frame."""

    words: tuple[str, ...]
    mesh: Mesh


@dataclass(frozen=True, eq=False)
class Level:
    """One storey of a house, as a source passes it to the stages.

    ``walls`` holds everything that may be a wall: walls, columns and windows by the source's names, everything without
    a name, and all points of a point cloud. ``leaves`` holds doors (leaves, frames) and ``furniture`` furniture, by the
    source's names; neither is in ``walls``. ``only_walls`` is True if the source names its walls, so that ``walls``
    holds no furniture. ``floor`` is the plan area of the floor's faces, or
    None if the source has none. ``rooms`` and ``openings`` are those that the source names; ``named_openings`` is True
    if it names all of them (IFC), so that there are no others. ``unnamed_gaps`` is True if the source names doors,
    but a wide gap in a wall is a passage too. ``all_ways`` is True if the source states each way, so that no wall is
    cut. ``windows`` are those that the source names; for the stages they are wall.
    ``corrections`` is what a person says of the storey; it is applied to the finished plan (``stages.corrections``).
    ``cover`` is the area under slabs above head height, or None where the source keeps no slabs apart from its walls.
    ``outdoors`` is the area that the source says lies outside, or None.
    ``below`` is the area through which the floor of a lower level is visible, or None if the source shows none.
    ``stairs`` is the area of the stairs that lead up from there to this level, or None where the source names none.
    ``sills`` is True if doors are closed by a sill at h_g (SUNCG), so that the paper's two planes are enough.
    ``ceiling_m`` is the height above the floor up to which walls are examined.
    ``room_count`` is the number of rooms of this level that the source names, or None if it names none. ``n_objects``
    is the number of objects other than walls, which distinguishes a scene with objects only from an empty one.
    ``guesses`` names what the reader had to guess: "units", "up", "scale", "levels", EDGE where rooms end, CUT_OFF
    where walls end. ``unit_m`` is the length of the file's own unit, metres, with all that a person says of its size.
    ``signs`` are grounds of the plan's quality that the reader measured itself, by name, 0 to 1: of a robot's map, what
    its cells say against the plan. Any other source has none. ``seen_walls`` returns the area of the walls that the
    source shows, where the reader closes their gaps in ``walls`` itself (a robot's map). ``lines`` returns the names
    and points (n, 2) of all lines of a drawing.
    """

    id: str
    walls: Mesh
    ceiling_m: float
    frame: Frame
    floor: Polygon | MultiPolygon | None = None
    below: Polygon | MultiPolygon | None = None
    stairs: Polygon | MultiPolygon | None = None
    cover: Polygon | MultiPolygon | None = None
    outdoors: Polygon | MultiPolygon | None = None
    leaves: tuple[SourceObject, ...] = ()
    furniture: tuple[SourceObject, ...] = ()
    sills: bool = False
    named_openings: bool = False
    unnamed_gaps: bool = False
    all_ways: bool = False
    only_walls: bool = False
    guesses: tuple[str, ...] = ()
    unit_m: float = 1.0
    signs: Mapping[str, float] = field(default_factory=dict)
    measure_signs: Callable[[Sequence[Polygon], Sequence[Polygon]], Mapping[str, float]] | None = None
    seen_walls: Callable[[], BaseGeometry] | None = None
    lines: Callable[[], Sequence[tuple[str, npt.NDArray[np.float64]]]] | None = None
    rooms: tuple[SourceRoom, ...] = ()
    room_count: int | None = None
    openings: tuple[Opening, ...] = ()
    windows: tuple[Opening, ...] = ()
    corrections: tuple[Correction, ...] = ()
    n_objects: int = 0
    provenance: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def floor_with_rooms(self) -> BaseGeometry | None:
        """The source's floor with its rooms, which may cover the void of a stair; None if it has no floor."""
        if self.floor is None:
            return None
        drawn = [room.polygon for room in self.rooms if room.polygon is not None]
        shapely.prepare(self.floor)
        return self.floor if shapely.covers(self.floor, drawn).all() else unite([self.floor, *drawn])

    @property
    def has_no_rooms(self) -> bool:
        """Whether a person says of some place that it is no room."""
        return any(each.word in {"no_room", "outside"} for each in self.corrections)

    @property
    def names_doors(self) -> bool:
        """Whether the source names all openings, and has doors in some of them."""
        return self.named_openings and any(each.has_door for each in self.openings)

    @property
    def content(self) -> str:
        """The SHA-256 of what the source holds of the level's house, or "" where it is not known."""
        return str(self.provenance.get("sha256", ""))

    @property
    def door_meshes(self) -> tuple[Mesh, ...]:
        """The meshes of the ``leaves``."""
        return tuple(each.mesh for each in self.leaves)


MADE: Final = "procedural"
"""What the provenance of a house that the project makes says of its source."""


@dataclass(frozen=True)
class Input:
    """One input of a batch: cheap to list, small to pickle; a worker opens it.

    ``id`` is the base id (docs/format.md, "Ids"). ``reader`` names the module of pipeline.sources that opens the input
    ("suncg", "mesh_file", "ifc"). ``path`` is the file to open, for SUNCG the root folder; ``key`` selects a part of it
    (the sceneId for SUNCG, otherwise ""). ``options`` are options of the reader, as sorted (name, value) pairs.
    """

    id: str
    reader: str
    path: str
    key: str = ""
    options: tuple[tuple[str, str], ...] = ()


class Reader(Protocol):
    """The functions that each module of ``pipeline.sources`` defines."""

    def find(self, path: str, **options: str) -> Iterator[Input]:
        """List the inputs under a path, sorted by id."""
        ...

    def read(self, item: Input) -> Iterator[Level | RejectedLevel]:
        """Open one input and yield its levels; raise Rejection if none of it can be read."""
        ...


@dataclass(frozen=True)
class RejectedLevel:
    """A level that its reader could not read, although it can read others of the house."""

    id: str
    rejection: Rejection


@dataclass(frozen=True, eq=False)
class Evidence:
    """Result of the stage ``evidence``: the contents of a level by kind, as plan areas.

    ``walls`` reach from the floor to head height (``tall``), or to a window or a sloped roof. ``lintels`` hang over
    free floor. ``rails`` are thin and end below head height. ``furniture`` is everything else that stands on the floor.
    ``leaves`` are door leaves, open or closed; ``doorways`` are the places of known doors. ``floor`` is the source's or
    None. ``low_headroom`` is where a roof is too low to stand under. ``shallow_headers`` hang from the ceiling by a
    hand's breadth only. ``partial_height`` are parts of the walls that end below the ceiling (a garden's wall, a
    partition). ``heights`` are those of the sections, metres. ``scanned`` is True for a point cloud and the mesh of a
    scan. ``open_edge`` is where such a scan ends and nothing stands; it lies along the walls, disjoint from them, and
    closes what they leave open.
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
class FloorObstacle:
    """A piece of furniture: its footprint in the level frame, its height in metres, and the source's word for it.

    What is not ``in_room`` is an opening in the floor.
    """

    polygon: Polygon
    height_m: float
    word: str
    in_room: bool = True
