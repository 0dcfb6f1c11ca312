"""What passes between sources and stages: frozen, typed values.

Frames: a Level's meshes live in the LEVEL frame: metres, x right and y up in the plan, z height above the level's floor
(for SUNCG: above the foot of the wall meshes). ``Level.frame`` takes (x, y) of the level frame to the source's plan
axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.plan import DoorKind, Frame
from pipeline.geometry.bridges import Bridge
from pipeline.geometry.overlay import EMPTY
from pipeline.geometry.regions import OUTSIDE
from pipeline.rejection import Rejection


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles: ``vertices`` (n, 3) float64 metres, ``faces`` (m, 3) int64. No promise that it is welded or closed.

    A point cloud has vertices and no faces.
    """

    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int64]

    @property
    def is_cloud(self) -> bool:
        """Whether it has points only."""
        return len(self.vertices) > 0 and not len(self.faces)


@dataclass(frozen=True, eq=False)
class SourceRoom:
    """A room as the source names it: its own words, our labels for them, its plan polygon and/or box where known.

    ``words`` may be empty (a room without a name) and may be several. ``polygon`` is exact where the source has the
    room's geometry (IfcSpace), else None; ``box`` (x1, y1, x2, y2) covers the room and maybe more (SUNCG).
    Both are in the level frame.
    """

    words: tuple[str, ...]
    labels: tuple[str, ...]
    polygon: Polygon | None = None
    box: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class SourceOpening:
    """An opening that the source names (IFC): ``has_door`` tells a door from a mere opening; level frame, metres."""

    polygon: Polygon
    has_door: bool


@dataclass(frozen=True, eq=False)
class SourceObject:
    """A thing that the source tells apart from the walls, with its own words for it; triangles in the level frame."""

    words: tuple[str, ...]
    mesh: Mesh


@dataclass(frozen=True, eq=False)
class Level:
    """One storey of a house, as a source hands it to the stages.

    ``walls`` is all that may be wall: what the source names as wall, column or window, and all that it does not name;
    of a point cloud all points.
    ``leaves`` are what it names as doors (leaves, frames), ``furniture`` what it names as furniture; neither is in
    ``walls``. ``floor`` is the plan area of the floor's faces, or None where the source has none. ``rooms`` and
    ``openings`` are what the source says of them; ``named_openings`` is True where it names every one (IFC), so that
    what it does not name is none.
    ``no_rooms`` are points of which a person says that the region around them is no room.
    ``below`` is where one looks down onto the floor of a lower level, None where the source shows none.
    ``sills`` is True where doors are closed by a sill at h_g (SUNCG), so that the paper's two planes are enough.
    ``ceiling_m``: height above the floor up to which walls may be looked at.
    ``room_count``: rooms of this level as the source counts them, None where it names none. ``n_objects``: things that
    are not walls, for telling a scene of objects only from an empty one. ``guesses`` names what the reader had to
    guess: "units", "up", "scale", "levels".
    """

    id: str
    walls: Mesh
    ceiling_m: float
    frame: Frame
    floor: Polygon | MultiPolygon | None = None
    below: Polygon | MultiPolygon | None = None
    leaves: tuple[SourceObject, ...] = ()
    furniture: tuple[SourceObject, ...] = ()
    sills: bool = False
    named_openings: bool = False
    guesses: tuple[str, ...] = ()
    rooms: tuple[SourceRoom, ...] = ()
    room_count: int | None = None
    openings: tuple[SourceOpening, ...] = ()
    no_rooms: tuple[tuple[float, float], ...] = ()
    n_objects: int = 0
    provenance: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Input:
    """One input of a batch: cheap to list, small to pickle; a worker opens it.

    ``id`` is the base id (docs/format.md, "Ids"); ``reader`` names the module of pipeline.sources that opens it
    ("suncg", "mesh_file", "ifc"); ``path`` is what it opens (a file, or for SUNCG the root folder); ``key`` is what
    inside it (the sceneId for SUNCG, else ""). ``options`` are the reader's, as sorted (name, value) pairs.
    """

    id: str
    reader: str
    path: str
    key: str = ""
    options: tuple[tuple[str, str], ...] = ()


class Reader(Protocol):
    """What each module of ``pipeline.sources`` offers as functions of these names."""

    def find(self, path: str, **options: str) -> Iterator[Input]:
        """List the inputs under a path, sorted by id."""
        ...

    def read(self, item: Input) -> Iterator[Level | RejectedLevel]:
        """Open one input and yield its levels; raises Rejection where nothing of it can be read."""
        ...


@dataclass(frozen=True)
class RejectedLevel:
    """A level that its reader had to give up while others of the house can be read."""

    id: str
    rejection: Rejection


@dataclass(frozen=True, eq=False)
class Doorway:
    """Where a door is known to be: ``polygon`` from jamb to jamb and from face to face of the wall.

    ``source`` says how: "named" by the source, a "leaf" that stands in it, or a "recess" under a lintel.
    """

    polygon: Polygon
    source: Literal["named", "leaf", "recess"]
    has_door: bool = True


@dataclass(frozen=True, eq=False)
class Evidence:
    """Stage ``evidence``: what stands in a level and what it is, as plan areas.

    ``walls`` stand from the floor to head height (``tall``), or end at a window or at a sloped roof. ``lintels`` hang
    over free floor; ``rails`` are thin and end below head height; ``furniture`` is all else that stands. ``leaves`` are
    the doors' leaves wherever they stand, ``doorways`` where doors are known to be. ``floor`` is the source's, or None;
    ``low`` is where a roof hangs too low to stand under, ``slight`` what hangs from the ceiling by a hand's breadth.
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


CloserKind: TypeAlias = Literal[
    "opening", "door", "lintel", "sill", "gap", "rail", "room_edge", "floor_edge", "wall_ends"
]


@dataclass(frozen=True, eq=False)
class Closer:
    """A piece of the closed plane P_g that does not stand in the door plane P_d.

    ``bridge`` is the straight strip that it is, from one space's face to the other's; a piece without one (a corner
    between two lintels, the boundary of an open house) closes, but nobody passes it.
    """

    polygon: Polygon
    kind: CloserKind
    bridge: Bridge | None = None


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
class Passage:
    """A way through a wall; the ``sides`` of its bridge are indices into the rooms of the same value, or OUTSIDE.

    ``why`` says of a cut what speaks for its place.
    """

    bridge: Bridge
    kind: DoorKind
    why: str = ""

    @property
    def leads_outside(self) -> bool:
        """Whether one side is the outside; such a passage stays closed in the outline."""
        return OUTSIDE in self.bridge.sides


@dataclass(frozen=True, eq=False)
class JoinedPair:
    """Two points (2, 2) that a cut joined, and the disc and the grid with which a picture plans the path of the two."""

    points: npt.NDArray[np.float64]
    radius_m: float
    pixels_per_metre: int


@dataclass(frozen=True, eq=False)
class Spaces:
    """From stage ``doors`` on: a house as rooms and ways between them.

    ``walls`` is the closed plane. ``joins`` are pairs of rooms that meet without a wall and without a door (under a
    beam too wide for one). ``outlines`` are the outer contours, one a free-standing part of the house. ``joined`` are
    the pairs of points that cuts were made for. ``notes`` counts what the rules did, by rule.
    """

    walls: BaseGeometry
    rooms: tuple[Polygon, ...]
    passages: tuple[Passage, ...]
    joins: tuple[tuple[int, int], ...] = ()
    outlines: tuple[Polygon, ...] = ()
    joined: tuple[JoinedPair, ...] = ()
    notes: Mapping[str, int | str] = field(default_factory=dict)

    def keeping(self, keep: Sequence[int], **notes: int | str) -> Spaces:
        """Only these rooms, in this order, and the passages whose rooms are all kept or outside."""
        new = {old: k for k, old in enumerate(keep)} | {OUTSIDE: OUTSIDE}
        passages = []
        for p in self.passages:
            a, b = p.bridge.sides
            if a in new and b in new:
                passages.append(replace(p, bridge=replace(p.bridge, sides=(new[a], new[b]))))
        return replace(
            self,
            rooms=tuple(self.rooms[k] for k in keep),
            passages=tuple(passages),
            joins=tuple((new[a], new[b]) for a, b in self.joins if a in new and b in new),
            notes={**self.notes, **notes},
        )


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
