"""What a source hands to the stages.

Frames: a Level's meshes live in the LEVEL frame: metres, x right and y up in the plan, z height above the level's floor
(for SUNCG: above the foot of the wall meshes). ``Level.frame`` takes (x, y) of the level frame to the source's plan
axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Protocol

from shapely import MultiPolygon, Polygon

from houseexpo.plan import Frame
from pipeline.geometry.doorways import Doorway
from pipeline.geometry.mesh import Mesh
from pipeline.rejection import Rejection


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
    ``walls``. ``floor`` is the plan area of the floor's faces, or None if the source has none. ``rooms`` and
    ``openings`` are what the source says of them; ``named_openings`` is True where it names every one (IFC), so that
    what it does not name is none.
    ``no_rooms`` are points of which a person says that the region around them is no room.
    ``below`` is where one looks down onto the floor of a lower level, or None if the source shows none.
    ``sills`` is True where doors are closed by a sill at h_g (SUNCG), so that the paper's two planes are enough.
    ``ceiling_m``: height above the floor up to which walls may be looked at.
    ``room_count``: rooms of this level as the source counts them, or None if it names none. ``n_objects``: things that
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

    @property
    def named_doorways(self) -> tuple[Doorway, ...]:
        """The ``openings`` as the stages take them."""
        return tuple(Doorway(each.polygon, "named", each.has_door) for each in self.openings)

    @property
    def door_meshes(self) -> tuple[Mesh, ...]:
        """The meshes of the ``leaves``."""
        return tuple(each.mesh for each in self.leaves)


MADE: Final = "procedural"
"""What the provenance of a house that the project makes says of its source."""


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
        """Open one input and yield its levels; raise Rejection if nothing of it can be read."""
        ...


@dataclass(frozen=True)
class RejectedLevel:
    """A level that its reader had to give up while others of the house can be read."""

    id: str
    rejection: Rejection
