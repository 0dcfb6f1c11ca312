"""Pieces that close the door plane, as the straight strips they consist of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

import networkx
import numpy as np
import numpy.typing as npt
import shapely
from networkx.utils import UnionFind
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.bridge import Bridge, strips_of
from pipeline.geometry.bridges import REACH_M, bridges
from pipeline.geometry.overlay import Shapes, areas, mitred, overlap, overlaps, polygons_of, subtract, united
from pipeline.geometry.regions import OUTSIDE, WALL, each_opened, filled, locate

IN_LINE_M = 0.8
LAP_M = 0.002
"""A piece laps so far over what it joins, so that no crack of rounding stays open between them."""
ROUNDING_M2 = 1e-9
EPS_M = 1e-5
TOUCH_M = 1e-3
CONTACT_M = 1e-5
SHARES = np.array([[-0.3], [0.0], [0.3]])
"""Where along a face is looked, from its middle, in widths of the bridge."""


CloserKind: TypeAlias = Literal[
    "opening", "door", "lintel", "sill", "gap", "gate", "rail", "room_edge", "floor_edge", "wall_ends"
]
"""``gate``: a wide gap; it closes to the outside, and between two rooms that are much broader."""
GAPS: Final = frozenset({"gap", "gate"})


@dataclass(frozen=True, eq=False)
class Closer:
    """A piece of the closed plane P_g that does not stand in the door plane P_d.

    ``bridge`` is the straight strip that it is, from one space's face to the other's; a piece without one (a corner
    between two lintels, the boundary of an open house) closes, but nobody passes it.
    """

    polygon: Polygon
    kind: CloserKind
    bridge: Bridge | None = None


def lapped(pieces: list[Polygon]) -> list[Polygon]:
    """Pieces of one plane, a little larger, so that they meet the walls of the other."""
    return list(mitred(np.array(pieces, dtype=np.object_), LAP_M))


def parted(
    door: BaseGeometry, pieces: list[Closer], plane: BaseGeometry, rooms: list[Polygon]
) -> tuple[list[Closer], list[Closer]]:
    """Take each piece apart into its bridges and the rest of it, in the ``plane`` that all of them close.

    A lintel that goes over into a cornice, or two lintels that meet in a corner, come as one piece; each strip has to
    be judged for itself, and what hangs over one room only is freed.
    """
    found: list[Closer] = []
    rest: list[Closer] = []
    for piece, strips in zip(pieces, bridges([p.polygon for p in pieces], rooms, plane, door), strict=True):
        laps = list(strips_of(strips, deeper_m=LAP_M, wider_m=LAP_M))
        found += [Closer(lap, piece.kind, bridge) for lap, bridge in zip(laps, strips, strict=True)]
        if piece.kind != "gate":  # of which nothing closes by itself
            rest += [Closer(p, piece.kind) for p in _less(piece.polygon, laps)]
    if not rest:
        return found, []
    found_bridges = [c.bridge for c in found if c.bridge is not None]
    in_line = united(strips_of(found_bridges, deeper_m=LAP_M, wider_m=IN_LINE_M))
    return found, [part for piece in rest for part in _divided(piece, in_line)]


def _less(piece: Polygon, strips: list[Polygon]) -> list[Polygon]:
    left: BaseGeometry = piece
    for strip in strips:
        left = subtract(left, strip)
    # a hair wider: along an oblique cut, rounding would leave a crack between strip and rest
    return [polygons_of(mitred(p, EPS_M))[0] for p in polygons_of(left) if p.area > ROUNDING_M2]


def _divided(piece: Closer, in_line: BaseGeometry) -> list[Closer]:
    """A rest where beams cross: what goes on in line with a bridge, and what leads away from it."""
    if not piece.polygon.intersects(in_line):
        return [piece]
    parts = polygons_of(overlap(piece.polygon, in_line)) + polygons_of(subtract(piece.polygon, in_line))
    return [Closer(p, piece.kind) for p in parts]


def needed(
    door: BaseGeometry, kept: list[Closer], pieces: list[Closer], plane: BaseGeometry, rooms: list[Polygon]
) -> list[Closer]:
    """Those of ``pieces`` without which, beside ``kept``, spaces would run into each other.

    ``plane`` is the door plane with all of these in it, and ``rooms`` are what it encloses. The last piece is taken
    away first. Without it, all spaces and all pieces already taken away that it touches become one: it may go as long
    as that holds no two spaces, the outside being one of them.
    """
    spaces = [*rooms, _outside(plane)]
    others = united(closer.polygon for closer in kept)
    bare = [subtract(subtract(piece.polygon, door), others) for piece in pieces]
    shapes = [areas(shape) for shape in each_opened(bare, 4 * EPS_M)]
    grown = shapely.buffer(shapes, TOUCH_M, join_style="mitre")
    meets = networkx.Graph()
    meets.add_edges_from((("piece", k), ("space", space)) for k, space in _touching(grown, spaces))
    meets.add_edges_from((("piece", k), ("piece", other)) for k, other in _touching(grown, shapes) if k != other)
    sets = UnionFind([("space", k) for k in range(len(spaces))])
    left = []
    gone: set[int] = set()
    for k in range(len(pieces) - 1, -1, -1):
        node = ("piece", k)
        touched = [n for n in meets[node] if n[0] == "space" or n[1] in gone] if node in meets else []
        owners = {sets[n] for n in touched}
        held = {sets[("space", space)] for space in range(len(spaces))} & owners
        if len(held) > 1:
            left.append(k)
            continue
        gone.add(k)
        sets.union(node, *touched)
    return [pieces[k] for k in sorted(left)]


def closed_plane(door: BaseGeometry, closers: Iterable[Closer]) -> BaseGeometry:
    """The door plane with these pieces in it."""
    return united([door, *(c.polygon for c in closers)])


def _outside(plane: BaseGeometry) -> BaseGeometry:
    """The air around a house, a metre of it."""
    house = filled(plane)
    return subtract(shapely.box(*shapely.bounds(house)).buffer(1.0), house)


def _touching(grown: Shapes, others: Sequence[BaseGeometry]) -> list[tuple[int, int]]:
    """Which of the grown pieces lie over which of the others for more than a point: pairs of indices."""
    tree = shapely.STRtree(others)
    pairs = tree.query(grown, predicate="intersects")
    shared = shapely.area(overlaps(grown[pairs[0]], tree.geometries[pairs[1]]))
    return [(int(k), int(other)) for k, other in pairs.T[shared > TOUCH_M * CONTACT_M]]


def with_sides(closers: list[Closer], rooms: list[Polygon], plane: BaseGeometry) -> list[Closer]:
    """The same pieces, the sides of their bridges looked up in ``rooms``: seen from three places along each face."""
    looks = [_before_faces(closer.bridge) for closer in closers if closer.bridge is not None]
    faces = locate(np.array(looks).reshape(-1, 2), rooms, plane).reshape(-1, 2, 3)
    found, k = [], 0
    for closer in closers:
        if closer.bridge is None:
            found.append(closer)
            continue
        sides = (_most(faces[k, 0]), _most(faces[k, 1]))
        blind = (faces[k] == WALL).all(axis=1)
        if (
            closer.kind in {"gap", "gate"} and blind.any()
        ):  # between a curtain and the next, before a wall: it leads nowhere
            sides = (sides[int(blind[0])],) * 2
        same = sides == closer.bridge.sides
        found.append(closer if same else replace(closer, bridge=replace(closer.bridge, sides=sides)))
        k += 1
    return found


def _before_faces(bridge: Bridge) -> npt.NDArray[np.float64]:
    """Three places (2, 3, 2) before each of the two faces of a bridge."""
    off = bridge.across * (bridge.depth / 2 + 2 * REACH_M)
    along = bridge.centre + bridge.along * bridge.width * SHARES
    return np.array([along - off, along + off])


def _most(faces: npt.NDArray[np.int64]) -> int:
    """The space seen most often; walls count only where nothing else is seen, and then as the outside."""
    seen = [face for face in faces.tolist() if face != WALL]
    return max(sorted(set(seen)), key=seen.count, default=OUTSIDE)
