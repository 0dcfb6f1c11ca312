"""Make a storey's walls from its cells: the cells' edges, the slabs on them, and the doors and windows in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import networkx as nx
import numpy as np
import numpy.typing as npt
import shapely

from pipeline.sources.homes.level import DOOR_HEAD_M, SILL_M
from tests.builders.suncg_houses.values import (
    SLAB_M,
    WINDOW_HEAD_M,
    WINDOW_LOW_M,
    Cell,
    Opening,
    Part,
    Point,
    Wall,
)

_MEETS_M = 1e-4


@dataclass(frozen=True, eq=False)
class CellEdges:
    """All edges of all cells, each with its cell on the left; arrays of one row an edge."""

    cell: npt.NDArray[np.int64]
    start: npt.NDArray[np.float64]
    direction: npt.NDArray[np.float64]
    length: npt.NDArray[np.float64]
    turn: npt.NDArray[np.float64]
    """(n, 2): by how much the outline turns at the edge's start and at its end, radians."""


@dataclass(frozen=True)
class SharedEdgePart:
    """The part of ``edge`` (of cell ``cells[0]``) that cell ``cells[1]`` shares."""

    edge: int
    cells: tuple[int, int]
    part: Part


def cell_edges(cells: list[Cell]) -> CellEdges:
    """List the edges of all cells, ring by ring."""
    owner, starts, ends, turns = [], [], [], []
    for index, cell in enumerate(cells):
        polygon = shapely.orient_polygons(cell.polygon)
        for ring in (polygon.exterior, *polygon.interiors):
            points = shapely.get_coordinates(ring)[:-1]
            step = np.roll(points, -1, axis=0) - points
            heading = np.arctan2(step[:, 1], step[:, 0])
            turn = (heading - np.roll(heading, 1) + np.pi) % (2 * np.pi) - np.pi
            owner += [index] * len(points)
            starts.append(points)
            ends.append(np.roll(points, -1, axis=0))
            turns.append(np.stack([turn, np.roll(turn, -1)], axis=1))
    start, end = np.concatenate(starts), np.concatenate(ends)
    length = np.hypot(*(end - start).T)
    return CellEdges(np.array(owner), start, (end - start) / length[:, None], length, np.concatenate(turns))


def shared_edge_parts(edges: CellEdges) -> list[SharedEdgePart]:
    """Return each piece of border that two cells share, once from either side."""
    d = edges.direction
    opposite = d @ d.T < -1 + 1e-6
    relative = edges.start[None, :, :] - edges.start[:, None, :]  # [i, j]: from the start of i to the start of j
    off = np.abs(relative[:, :, 0] * d[:, None, 1] - relative[:, :, 1] * d[:, None, 0])
    high = np.einsum("ijk,ik->ij", relative, d)  # an opposite edge begins further on and ends before
    low = np.maximum(high - edges.length[None, :], 0.0)
    high = np.minimum(high, edges.length[:, None])
    meets = opposite & (off < _MEETS_M) & (high - low > _MEETS_M) & (edges.cell[:, None] != edges.cell[None, :])
    return [
        SharedEdgePart(i, (int(edges.cell[i]), int(edges.cell[j])), (float(low[i, j]), float(high[i, j])))
        for i, j in np.argwhere(meets).tolist()
    ]


def outer_edge_parts(edges: CellEdges, shared: list[SharedEdgePart]) -> list[tuple[int, Part]]:
    """Return the parts of edges that no other cell shares: (edge, part)."""
    inner: dict[int, list[Part]] = {}
    for each in shared:
        inner.setdefault(each.edge, []).append(each.part)
    result = []
    for edge, length in enumerate(edges.length.tolist()):
        at = 0.0
        for low, high in [*sorted(inner.get(edge, [])), (length, length)]:
            if low - at > _MEETS_M:
                result.append((edge, (at, low)))
            at = max(at, high)
    return result


# Walls: a pair of slabs for each edge of each cell, and the holes in them.


Hole = tuple[float, float, float, float]
"""From, to along the slab, and from, to in height."""

_REACH_M = 0.12  # an opening passes through every slab whose centre line is this near
_SKEWED_SHARE, _SHIFTED_SHARE = 0.05, 0.08
_DRIFT_M = 0.03  # a skewed wall's ends are no further from its line


@dataclass(frozen=True)
class Slab:
    """A box in the plan: along ``axis`` from ``span[0]`` to ``span[1]``, to the left from ``offset[0]`` to ``[1]``."""

    inside: bool
    origin: npt.NDArray[np.float64]
    axis: npt.NDArray[np.float64]
    span: tuple[float, float]
    offset: tuple[float, float]

    def plan(self, at: npt.NDArray[np.float64], side: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Return the plan points (n, 2) at distances ``at`` along and ``side`` to the left."""
        normal = np.array([-self.axis[1], self.axis[0]])
        plan: npt.NDArray[np.float64] = self.origin + at[:, None] * self.axis + side[:, None] * normal
        return plan

    def corners(self) -> npt.NDArray[np.float64]:
        """Return the four plan corners."""
        (a, b), (low, high) = self.span, self.offset
        return self.plan(np.array([a, b, b, a]), np.array([low, low, high, high]))


def build_walls(edges: CellEdges, inner: set[int], rng: np.random.Generator) -> list[Wall]:
    """Give every edge its wall; of those that lie between rooms (``inner``) a few are skewed or shifted."""
    walls = []
    for edge, length in enumerate(edges.length.tolist()):
        ends = SLAB_M * np.abs(np.tan(edges.turn[edge] / 2))
        shift = skew = 0.0
        draw = rng.random()
        if edge in inner and length > 1.0:
            if draw < _SKEWED_SHARE:
                skew = float(rng.uniform(-1, 1)) * min(np.radians(1.0), 2 * _DRIFT_M / length)
            elif draw < _SKEWED_SHARE + _SHIFTED_SHARE:
                shift = float(rng.uniform(-0.01, 0.01))
        start, direction = tuple(edges.start[edge].tolist()), tuple(edges.direction[edge].tolist())
        walls.append(
            Wall(int(edges.cell[edge]), start, direction, length, (float(ends[0]), float(ends[1])), shift, skew)
        )
    return walls


def wall_slabs(wall: Wall) -> Iterator[Slab]:
    """Yield the slabs of a wall that are built: inside and outside, piece by piece."""
    origin, axis = _frame(wall)
    at = -wall.ends[0]
    for low, high in [*wall.missing, (wall.length + wall.ends[1], np.inf)]:
        if low - at > 0.02:
            yield Slab(True, origin, axis, (at, low), (0.0, SLAB_M))
            yield Slab(False, origin, axis, (at, low), (-SLAB_M, 0.0))
        at = high


def walls_area(walls: tuple[Wall, ...]) -> shapely.Geometry:
    """Return the plan area of all walls as if nothing were missing and no opening cut."""
    whole = [
        Slab(True, *_frame(wall), (-wall.ends[0], wall.length + wall.ends[1]), (-SLAB_M, SLAB_M)) for wall in walls
    ]
    return shapely.union_all(shapely.polygons(np.array([slab.corners() for slab in whole])))


def slab_holes(slab: Slab, openings: list[Opening]) -> list[Hole]:
    """Return the holes that openings make in a slab, in order along it."""
    (x, y), (dx, dy) = slab.origin.tolist(), slab.axis.tolist()
    holes = []
    for opening in openings:
        rx, ry = opening.centre[0] - x, opening.centre[1] - y
        parallel = abs(opening.direction[0] * dx + opening.direction[1] * dy) > 0.99
        if not parallel or abs(ry * dx - rx * dy) >= _REACH_M:
            continue
        middle = rx * dx + ry * dy
        low, high = middle - opening.width / 2, middle + opening.width / 2
        if slab.span[0] < low and high < slab.span[1]:
            heights = (WINDOW_LOW_M, WINDOW_HEAD_M) if opening.kind == "window" else (SILL_M, DOOR_HEAD_M)
            holes.append((low, high, *heights))
    return sorted(holes)


def _frame(wall: Wall) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return where a wall starts and which way it runs, shift and skew included."""
    (x, y), (dx, dy), half = wall.start, wall.direction, wall.length / 2
    c, s = np.cos(wall.skew), np.sin(wall.skew)
    ax, ay = dx * c - dy * s, dx * s + dy * c
    middle = x + dx * half - dy * wall.shift, y + dy * half + dx * wall.shift
    return np.array([middle[0] - ax * half, middle[1] - ay * half]), np.array([ax, ay])


# Doors, entrances and windows: where people would have them, clear of every corner.


FROM_CORNER_M = 0.15  # from a wall's centre line: 0.10 m from its face
_SOCIAL = {"Living_Room", "Dining_Room", "Kitchen", "Hall", "Lobby", "Entryway", "Room"}
_WET = {"Bathroom", "Toilet"}
_NARROW = {"Bathroom", "Toilet", "Storage", "Wardrobe", "Boiler_room", "Balcony", "Loggia"}


def place_interior_doors(
    cells: list[Cell], edges: CellEdges, shared: list[SharedEdgePart], rng: np.random.Generator
) -> list[Opening]:
    """Join all rooms by doors, each pair that people would join first, and some pairs more; shafts get none."""
    graph = nx.Graph()
    for each in shared:
        i, j = each.cells
        if i < j and "shaft" not in {cells[i].use, cells[j].use}:
            clear = each.part[1] - each.part[0] - 2 * FROM_CORNER_M
            if clear >= 0.65 and clear > graph.get_edge_data(i, j, {"clear": 0.0})["clear"]:
                graph.add_edge(i, j, clear=clear, border=each, cost=_cost(cells[i], cells[j], rng))
    tree = nx.minimum_spanning_tree(graph, weight="cost")
    doors = []
    for i, j, data in graph.edges(data=True):
        if tree.has_edge(i, j) or (data["cost"] < 2.6 and rng.random() < 0.22):
            width = _door_width(cells[i], cells[j], rng)
            border = data["border"]
            doors.append(Opening("door", *_place_opening(edges, border.edge, border.part, width, rng), cells=(i, j)))
    return doors


def are_all_cells_joined(cells: list[Cell], doors: list[Opening]) -> bool:
    """Return whether every cell that should have a door can be reached from every other."""
    graph = nx.Graph()
    graph.add_nodes_from(i for i, cell in enumerate(cells) if cell.use not in {"shaft", "garage"})
    graph.add_edges_from(door.cells for door in doors)
    return bool(nx.is_connected(graph))


def place_entrances(
    cells: list[Cell], edges: CellEdges, outer: list[tuple[int, Part]], rng: np.random.Generator
) -> list[Opening]:
    """Give the house a front door, sometimes a second one, and each garage its gate."""
    found = []
    fit = [(edge, part) for edge, part in outer if part[1] - part[0] > 1.0 + 2 * FROM_CORNER_M]
    ranked = sorted(fit, key=lambda each: _front_cost(cells[edges.cell[each[0]]]) + float(rng.uniform(0, 1.5)))
    ranked = [each for each in ranked if cells[edges.cell[each[0]]].use in {"room", "corridor"}]
    for edge, part in ranked[: 1 + int(rng.random() < 0.25)]:
        place = _place_opening(edges, edge, part, float(rng.uniform(0.85, 1.0)), rng)
        found.append(Opening("entrance", *place, cells=(int(edges.cell[edge]), None)))
    taken = {edge for edge, _ in ranked[:2]}
    for index, cell in enumerate(cells):
        gates = [e for e in fit if edges.cell[e[0]] == index and e[1][1] - e[1][0] > 2.7 and e[0] not in taken]
        if (cell.use == "garage" or "Garage" in cell.words) and gates:
            edge, part = gates[int(rng.integers(len(gates)))]
            found.append(Opening("entrance", *_place_opening(edges, edge, part, 2.3, rng), cells=(index, None)))
    return found


def place_windows(
    cells: list[Cell], edges: CellEdges, outer: list[tuple[int, Part]], taken: list[Opening], rng: np.random.Generator
) -> list[Opening]:
    """Give most outer walls a window where no entrance is, long ones two."""
    found = []
    for edge, (low, high) in outer:
        cell = cells[edges.cell[edge]]
        if high - low < 1.3 or cell.use == "shaft" or rng.random() < (0.5 if set(cell.words) & _NARROW else 0.15):
            continue
        middle = edges.start[edge] + edges.direction[edge] * (low + high) / 2
        if any(np.hypot(*(np.array(each.centre) - middle)) < (high - low) / 2 for each in taken):
            continue
        parts = [(low, high)] if high - low < 4.5 else [(low, (low + high) / 2), ((low + high) / 2, high)]
        for part in parts:
            width = float(rng.uniform(0.5, 0.75)) * min(part[1] - part[0] - 2 * FROM_CORNER_M, 2.6)
            place = _place_opening(edges, edge, part, width, rng)
            found.append(Opening("window", *place, cells=(int(edges.cell[edge]), None)))
    return found


def _place_opening(
    edges: CellEdges, edge: int, part: Part, width: float, rng: np.random.Generator
) -> tuple[Point, Point, float]:
    """Return centre, direction and width of an opening somewhere in a part of an edge, narrower where there is no room.

    Most stand near a corner or in the middle, few just anywhere.
    """
    room = part[1] - part[0] - 2 * FROM_CORNER_M
    width = round(min(width, room), 3)
    at = part[0] + FROM_CORNER_M + width / 2 + (room - width) * float(rng.choice([0.0, 0.5, 1.0, rng.random()]))
    (x, y), (dx, dy) = edges.start[edge].tolist(), edges.direction[edge].tolist()
    return (x + dx * at, y + dy * at), (dx, dy), width


def _cost(a: Cell, b: Cell, rng: np.random.Generator) -> float:
    """Return how unlikely a door between two rooms is."""
    noise = float(rng.uniform(0, 0.8))
    if "corridor" in {a.use, b.use}:
        return 1.0 + noise
    words_a, words_b = set(a.words), set(b.words)
    social = bool(words_a & _SOCIAL) + bool(words_b & _SOCIAL)
    if words_a & _WET and words_b & _WET:
        return 8.0 + noise
    if (words_a | words_b) & _WET and (words_a | words_b) & {"Kitchen", "Dining_Room", "Garage"}:
        return 6.0 + noise
    return (5.0, 3.0, 2.0)[social] + noise


def _front_cost(cell: Cell) -> float:
    if cell.use == "corridor" or set(cell.words) & {"Entryway", "Lobby", "Hall"}:
        return 0.0
    return 2.0 if set(cell.words) & _SOCIAL else 5.0


def _door_width(a: Cell, b: Cell, rng: np.random.Generator) -> float:
    words = set(a.words) | set(b.words)
    if words & _NARROW:
        return float(rng.uniform(0.7, 0.8))
    if words & {"Living_Room", "Dining_Room", "Lobby", "Hall"} and rng.random() < 0.25:
        return float(rng.uniform(1.2, 1.8))
    return float(rng.uniform(0.75, 1.0))
