"""Rooms and doors as a graph, and what a disc robot of a given radius can reach."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Final

import numpy as np
import numpy.typing as npt

from houseexpo.frame import GridFrame
from houseexpo.plan import FloorPlan, Navigability, Reach
from houseexpo.raster import fill
from houseexpo.standing import Piece, Standing, eroded, straightened

if TYPE_CHECKING:
    import networkx as nx
    from shapely import MultiPolygon, Polygon

OUTSIDE: Final = "outside"
RADII_M: Final = (0.10, 0.15, 0.20, 0.25, 0.30, 0.35)


def rooms_graph(plan: FloorPlan, *, outside: bool = False) -> nx.MultiGraph[int | str]:
    """Return rooms as nodes, doors as edges.

    A node is a room's id with ``label`` and ``area`` (m2); an edge joins the two rooms of a door, keyed by the door's
    id, with ``kind`` and ``width`` (m). Two doors between the same rooms are two edges, hence a MultiGraph.

    Entrances lead to a node "outside" where ``outside`` is True; they are left out by default, because a way through
    the garden would count as a way from room to room.
    """
    import networkx as nx

    graph: nx.MultiGraph[int | str] = nx.MultiGraph(id=plan.id)
    for room in plan.rooms:
        graph.add_node(room.id, label=room.label, area=room.area)
    for door in plan.doors:
        one, other = (OUTSIDE if room is None else room for room in door.rooms)
        if outside or OUTSIDE not in (one, other):
            graph.add_edge(one, other, key=door.id, kind=door.kind, width=door.width)
    return graph


def navigability(space: FloorPlan | Polygon | MultiPolygon, radii: Sequence[float] = RADII_M) -> Reach:
    """Measure what a disc robot can reach, for each radius (metres; the keys have two decimals).

    1. The disc's centre can stand on the free space eroded by the radius; its connected pieces are counted, specks
       under 0.1 m2 left out (here and in all that follows).
    2. ``largest_share`` is the biggest piece's share of the pieces' area, 0.0 where there is none.
    3. ``narrowest`` is the width of the bottleneck of the biggest piece, metres: erode it further until it falls into
       two pieces; twice the radius at which it does is the narrowest place that must be passed to get between any two
       of its places. A piece that never falls apart has no passage; its narrowest is the widest disc that fits.
       A place counts where it outlives the split by up to 0.05 m of radius.

    Walls are straightened by at most 0.01 m first and ``narrowest`` is given to 0.01 m; a disc that is wider or
    narrower than a passage by more than 0.02 m is judged as exact geometry judges it.
    """
    standing = Standing(straightened(space.free_space if isinstance(space, FloorPlan) else space))
    said = cache(Navigability)  # most radii say the same of a plan
    found = {}
    for radius in radii:
        pieces = standing.pieces(radius)
        narrowest = standing.width(pieces[0], radius) if pieces else 0.0
        found[f"{radius:.2f}"] = said(len(pieces), _largest_share(pieces), round(narrowest, 2))
    return Reach(found)


def standing_pieces(space: Polygon | MultiPolygon, radius_m: float) -> list[Polygon]:
    """Return the pieces in which the centre of a disc can stand, the biggest first; specks under 0.1 m2 left out."""
    return eroded(straightened(space), radius_m)


def standing_components(
    space: Polygon | MultiPolygon, radius_m: float, pixels_per_metre: float
) -> tuple[npt.NDArray[np.int32], GridFrame]:
    """Rasterise ``standing_pieces``: 0 where the disc cannot stand, 1 for cells of the biggest piece, 2 for the next.

    Cells belong together as the exact geometry says, also where a neck is thinner than a cell.
    """
    frame = GridFrame.around(space.bounds, pixels_per_metre)
    labels = np.zeros(frame.shape, dtype=np.int32)
    for label, piece in enumerate(standing_pieces(space, radius_m), start=1):
        fill(labels, piece, frame, label)
    return labels, frame


def _largest_share(pieces: Sequence[Piece]) -> float:
    """Return the biggest piece's share of the area; it comes first."""
    if len(pieces) <= 1:
        return float(len(pieces))
    return round(float(pieces[0].polygon.area / sum(piece.polygon.area for piece in pieces)), 4)
