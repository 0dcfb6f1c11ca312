"""Make a networkx graph of a plan, with rooms as nodes and doors as edges, and find shortest walking paths (metres).

Rooms have a label and an area (m2), doors a kind and a width (m). Rooms that meet in the open, without a wall, are
neighbours too: the graph has as many pieces as the free space.

Shortest paths inside a polygon turn only at its reflex corners. They are therefore found exactly, on the graph of
corners that see each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.errors import PlanError
from houseexpo.plan import Door, Room
from houseexpo.plan.model import PlanData
from houseexpo.tolerances import GRID_M, MAX_CORNERS, SLACK_M, STRAIGHTEN_LARGE_M, STRAIGHTEN_PATH_M

if TYPE_CHECKING:
    import networkx as nx
    from shapely import MultiPolygon, Polygon


Points = npt.NDArray[np.float64]
OUTSIDE: Final = "outside"
OPEN: Final = "open"
"""The kind of an edge between two rooms that meet without a wall."""


@dataclass(frozen=True)
class OpenBorder:
    """A border without a wall: the ids of its two rooms, and the ends (x, y) of its longest straight piece, metres."""

    rooms: tuple[int, int]
    segment: tuple[tuple[float, float], tuple[float, float]]

    @property
    def width(self) -> float:
        """Length of the segment, metres, to the centimetre."""
        return round(math.dist(*self.segment), 2)


def open_borders(plan: PlanData) -> list[OpenBorder]:
    """Return the borders without a wall between rooms, as under a beam or where a source divides a space.

    A wall keeps two rooms at least one cell of the plan's grid (1 cm) apart.
    """
    if len(plan.rooms) < 2:
        return []
    import shapely

    shapes = [room.polygon for room in plan.rooms]
    pairs = shapely.STRtree(shapes).query(shapes, predicate="intersects").T.tolist()
    found = []
    for one, other in sorted((i, j) for i, j in pairs if i < j):
        shared = shapely.intersection(shapes[one].boundary, shapes[other].boundary)
        lines = [part for part in shapely.get_parts(shared) if part.length > 0]
        if not lines:  # the rooms share only a corner
            continue
        merged = shapely.simplify(shapely.line_merge(shapely.multilinestrings(lines)), GRID_M)
        straight = (ends for line in shapely.get_parts(merged) for ends in pairwise(line.coords))
        (x1, y1), (x2, y2) = max(straight, key=lambda ends: math.dist(*ends))
        found.append(OpenBorder((plan.rooms[one].id, plan.rooms[other].id), ((x1, y1), (x2, y2))))
    return found


def rooms_graph(plan: PlanData, *, outside: bool = False) -> nx.MultiGraph[int | str]:
    """Return the graph of a plan with rooms as nodes and doors as edges.

    A node is the id of a room and has ``label`` and ``area`` (m2). An edge connects the two rooms of a door; its key is
    the door's id, and it has ``kind`` and ``width`` (m). Two doors between the same rooms are two edges, hence a
    MultiGraph. Two rooms that meet without a wall have an edge of kind "open"; its width is the length of the longest
    straight piece of their border. These edges have the keys -1, -2, ... A published plan has no rooms; use
    ``FloorPlan.graph`` or ``with_rooms``.

    With ``outside=True``, entrances lead to a node "outside". By default they are left out, because a path through the
    garden would count as a path between rooms.

    Parameters
    ----------
    plan
        A plan with rooms.
    outside
        Whether entrances lead to a node "outside".
    """
    import networkx as nx

    graph: nx.MultiGraph[int | str] = nx.MultiGraph(id=plan.id)
    for room in plan.rooms:
        graph.add_node(room.id, label=room.label, area=room.area)
    for door in plan.doors:
        one, other = (OUTSIDE if room is None else room for room in door.rooms)
        if outside or OUTSIDE not in (one, other):
            graph.add_edge(one, other, key=door.id, kind=door.kind, width=door.width)
    for number, border in enumerate(open_borders(plan), start=1):
        graph.add_edge(*border.rooms, key=-number, kind=OPEN, width=border.width)
    return graph


class WalkingPath(NamedTuple):
    """A shortest path: its corners (n, 2), metres, and its length in metres."""

    points: Points
    length: float


def shortest_path(space: Polygon | MultiPolygon, start: npt.ArrayLike, goal: npt.ArrayLike) -> WalkingPath | None:
    """Return the shortest path inside ``space`` between two points (2,), metres, or None if they are not connected.

    1. Walls are straightened by at most 0.02 m. A space with more than 800 reflex corners is simplified further, by at
       most 0.4 m, until no more than 800 are left.
    2. The path turns only at reflex corners. A* expands them in the order of the distance so far plus the straight
       line to the goal. The corners that a corner sees are computed when it is expanded.

    For a disc, pass the area in which its centre can be (``analysis.navigability.disc_centre_areas``).

    Examples
    --------
    >>> from shapely import Polygon
    >>> corner = Polygon([(0, 0), (6, 0), (6, 6), (3, 6), (3, 3), (0, 3)])
    >>> round(shortest_path(corner, (0, 2.9), (3.1, 6)).length, 2)
    6.1
    """
    import shapely

    ends = np.asarray([start, goal], dtype=np.float64)
    for jag in STRAIGHTEN_LARGE_M:
        shape = space.simplify(jag)
        nodes = np.concatenate([ends, *(_reflex(np.asarray(ring.coords)[:-1]) for ring in _rings(shape))])
        if len(nodes) <= MAX_CORNERS + 2:
            break
    return path_among_corners(shapely.buffer(shape, jag + SLACK_M, join_style="mitre"), nodes)


def path_among_corners(space: Polygon | MultiPolygon, nodes: Points) -> WalkingPath | None:
    """Return the shortest path inside ``space`` from the first to the second of ``nodes`` (n, 2), metres, by A*.

    The path turns only at other nodes, and ``space`` covers its segments. Without such a path, the result is None.
    """
    import shapely

    shapely.prepare(space)
    rest = np.hypot(*(nodes - nodes[1]).T)
    known, before = np.full(len(nodes), np.inf), np.full(len(nodes), -1)
    known[0], settled = 0.0, np.zeros(len(nodes), dtype=bool)
    waiting = [(float(rest[0]), 0)]
    while waiting:
        _, here = heappop(waiting)
        if here == 1:
            return WalkingPath(nodes[_trace_back(before)], float(known[1]))
        if settled[here]:
            continue
        settled[here] = True
        lengths = known[here] + np.hypot(*(nodes - nodes[here]).T)
        nearer = np.flatnonzero(~settled & (lengths < known - 1e-12))
        lines = np.stack([np.broadcast_to(nodes[here], (len(nearer), 2)), nodes[nearer]], axis=1)
        for there in nearer[shapely.covers(space, shapely.linestrings(lines))].tolist():
            known[there], before[there] = lengths[there], here
            heappush(waiting, (float(lengths[there] + rest[there]), there))
    return None


def distance_matrix(space: Polygon | MultiPolygon, points: npt.ArrayLike) -> Points:
    """Return the lengths (n, n) in metres of the shortest paths inside ``space`` between ``points`` (n, 2).

    The length is infinite if there is no path. Walls are first straightened by at most 0.02 m, and a point may lie
    outside by as much.
    """
    import shapely
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    ends = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    shape = space.simplify(STRAIGHTEN_PATH_M)
    nodes = np.concatenate([ends, *(_reflex(np.asarray(ring.coords)[:-1]) for ring in _rings(shape))])
    wide = shapely.buffer(shape, STRAIGHTEN_PATH_M + SLACK_M, join_style="mitre")
    shapely.prepare(wide)
    one, other = np.triu_indices(len(nodes), k=1)
    seen = shapely.covers(wide, shapely.linestrings(np.stack([nodes[one], nodes[other]], axis=1)))
    one, other = one[seen], other[seen]
    # 1e-12: connects two points in the same place; a stored 0 would mean no edge
    length = np.maximum(np.hypot(*(nodes[one] - nodes[other]).T), 1e-12)
    table = csr_array((length, (one, other)), shape=(len(nodes), len(nodes)))
    found: Points = dijkstra(table, directed=False, indices=np.arange(len(ends)))[:, : len(ends)]
    return np.where(found < 1e-9, 0.0, found)


def rooms_graph_with_distances(plan: PlanData, *, outside: bool = False) -> nx.MultiGraph[int | str]:
    """Return ``rooms_graph`` with walking distances in metres.

    In addition, a node has ``position``, a point (x, y) well inside the room, and an edge has ``distance``: the length
    of the shortest path inside the two rooms from one position to the other, through the middle of the door or of the
    open border. The distance of an entrance ends at the door. For each room with two or more edges,
    ``graph.graph["doors"]`` has the walking distance between each pair of doors or borders,
    ``{(key, key): metres}`` by the keys of their edges, so that longer paths need not pass through the middle of a
    room.

    Weighted shortest paths (``networkx.shortest_path_length(graph, a, b, "distance")``) are therefore distances between
    rooms.
    """
    graph = rooms_graph(plan, outside=outside)
    between: dict[tuple[int, int], float] = {}
    legs: dict[tuple[int, int], float] = {}
    borders = {-number: border for number, border in enumerate(open_borders(plan), start=1)}
    for room in plan.rooms:
        doors = [door for door in plan.doors if room.id in door.rooms]
        ways = {door.id: door.segment for door in doors}
        ways |= {key: border.segment for key, border in borders.items() if room.id in border.rooms}
        position = _inner_point(room)
        graph.nodes[room.id]["position"] = position
        lengths = distance_matrix(_with_doors(room, doors), [position, *map(_middle, ways.values())])
        for i, key in enumerate(ways, start=1):
            legs[room.id, key] = float(lengths[0, i])
            for j, other in enumerate(list(ways)[i:], start=i + 1):
                between[key, other] = round(float(lengths[i, j]), 3)
    for one, other, key, edge in graph.edges(keys=True, data=True):
        edge["distance"] = round(sum(legs[room, key] for room in (one, other) if room != OUTSIDE), 3)
    graph.graph["doors"] = between
    return graph


def _trace_back(before: npt.NDArray[np.int64]) -> list[int]:
    """Return the path from the first node to the second, given the predecessor of each node."""
    found = [1]
    while found[-1] != 0:
        found.append(int(before[found[-1]]))
    return found[::-1]


def _with_doors(room: Room, doors: list[Door]) -> Polygon | MultiPolygon:
    """Return the room together with its doors, since the middle of a door lies in the wall and not in the room.

    Raises
    ------
    PlanError
        A ring of the room or of a door crosses itself.
    """
    import shapely

    for key, shape in ((f"rooms[{room.id}]", room.polygon), *((f"doors[{door.id}]", door.polygon) for door in doors)):
        if not shape.is_valid:
            found = shapely.is_valid_reason(shape)
            raise PlanError(
                f"expected a simple ring, found {found}; houseexpo validate names all faults", f"{key}.polygon"
            )
    return shapely.union_all([room.polygon, *(door.polygon for door in doors)])


def _middle(segment: tuple[tuple[float, float], tuple[float, float]]) -> tuple[float, float]:
    (x1, y1), (x2, y2) = segment
    return (x1 + x2) / 2, (y1 + y2) / 2


def _inner_point(room: Room) -> tuple[float, float]:
    """Return the centroid if it lies in the room, else the centre of the widest disc."""
    import shapely

    centre = room.polygon.centroid
    if not room.polygon.contains(centre):
        centre = shapely.Point(shapely.maximum_inscribed_circle(room.polygon, tolerance=0.05).coords[0])
    return round(centre.x, 3), round(centre.y, 3)


def _rings(shape: Polygon | MultiPolygon) -> list[Polygon]:
    """Return all rings with the free space on their left: outer rings counter-clockwise, holes clockwise."""
    import shapely

    parts = shapely.get_parts(shapely.orient_polygons(shape))
    return [ring for part in parts if not part.is_empty for ring in (part.exterior, *part.interiors)]


def _reflex(ring: Points) -> Points:
    """Return the corners where the ring turns right, at walls that project into the room."""
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    return ring[before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] < 0]
