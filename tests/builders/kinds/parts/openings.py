"""Doors and windows of a storey:
R1  Every zone is reached: rooms from the corridor first, then from the living room, then from any room; closets and
    private bathrooms only from their bedroom.
R2  A few doors more than needed join living rooms, kitchens and dining rooms; some are wide openings or double doors.
R3  One entrance, from the hall where it lies at an outer wall; a garage has a wide one.
R4  Windows in the outer walls of rooms for people; some of them reach the floor.
R5  A leaf swings into a room where nothing is in its way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import networkx as nx
import numpy as np
import shapely
from numpy.random import Generator

from tests.builders.kinds.values import OUTSIDE, Leaf, Opening, Storey, Wall

HALLS = {"Corridor", "Hallway", "Hall", "Entryway", "Lobby", "Stair", "CORRIDOR"}
LIVING = {"Living_Room", "Kitchen", "Dining_Room"}
NO_WINDOW = {"Wardrobe", "Storage", "Stair"}
SMALL = {"Toilet", "Storage", "Wardrobe"}
JAMB_M = 0.08
WIDEST_GAP_M = 1.4  # a wider gap of full height would be no door, but one room


@dataclass(frozen=True)
class Heads:
    """Heights of a house: door heads, window heads, French windows; metres above the floor."""

    door: float
    window: float

    @staticmethod
    def draw(rng: Generator, height: float) -> Heads:
        """Door heads of 1.97 to 2.2 m, window heads the same every second time."""
        door = round(min(float(rng.choice([1.97, 2.0, 2.03, 2.05, 2.1, 2.13, 2.2])), height - 0.15), 3)
        window = door if rng.random() < 0.5 else round(float(rng.uniform(2.0, min(2.45, height - 0.1))), 2)
        return Heads(door, window)


class Chooser:
    """Places openings into walls, none over another, away from corners."""

    def __init__(self, storey: Storey, heads: Heads, rng: Generator) -> None:
        self.storey, self.heads, self.rng = storey, heads, rng
        self.made: list[Opening] = []
        self.tree = shapely.STRtree([shapely.LineString([w.a, w.b]) for w in storey.walls])
        self.open = [self._open(k) for k in range(len(storey.walls))]

    def _open(self, index: int) -> tuple[float, float]:
        """The stretch of a wall that rooms see on both sides."""
        wall = self.storey.walls[index]
        line = shapely.LineString([wall.a, wall.b])
        near = [self.storey.walls[k] for k in self.tree.query(line.buffer(0.5)) if k != index]
        others = [w for w in near if not same_line(w, wall)]
        strips = [w.strip(-w.thickness / 2, w.length + w.thickness / 2) for w in others]
        blocked = shapely.union_all(strips + [p.buffer(0.6) for p in self.storey.pillars])
        parts = [g for g in shapely.get_parts(line.difference(blocked)) if g.length > 0.3]
        if not parts:
            return 0.0, 0.0
        best = max(parts, key=lambda g: g.length)
        ends = sorted(line.project(shapely.Point(p)) for p in (best.coords[0], best.coords[-1]))
        return ends[0] + JAMB_M, ends[1] - JAMB_M

    def room_for(self, index: int, width: float) -> list[tuple[float, float]]:
        """Free stretches of a wall in which an opening of a width fits."""
        at, high = self.open[index]
        taken = sorted((o.start - 0.15, o.end + 0.15) for o in self.made if o.wall == index)
        free: list[tuple[float, float]] = []
        for a, b in [*taken, (high, high)]:
            if a - at >= width:
                free.append((at, a))
            at = max(at, b)
        return free

    def put(self, index: int, width: float, kind: str, sill: float, head: float, place: float | None = None) -> bool:
        """Make an opening at a random place, near an end (as doors are) or at ``place`` (0 to 1)."""
        free = self.room_for(index, width)
        if not free:
            return False
        low, high = free[int(self.rng.integers(len(free)))]
        share = self.rng.choice([0.0, 1.0, self.rng.random()]) if place is None else place
        start = round(low + float(share) * (high - low - width), 3)
        self.made.append(Opening(index, start, round(start + width, 3), kind, sill, head))
        return True


def same_line(one: Wall, other: Wall) -> bool:
    """Whether two walls lie on one line (they then go on, and block nothing)."""
    cross = one.along[0] * other.along[1] - one.along[1] * other.along[0]
    return bool(abs(cross) < 1e-6 and abs(other.across @ (np.array(one.a) - other.a)) < 1e-6)


def furnish_openings(
    storey: Storey, rng: Generator, private: dict[int, int], entrances: list[int], heads: Heads, windows: float = 0.8
) -> Storey | None:
    """Place doors (R1, R2), entrances (R3) and windows (R4); None where a room cannot be reached."""
    chooser = Chooser(storey, heads, rng)
    for a, b in tree(storey, chooser, private, entrances):
        if not join(chooser, a, b):
            return None
    extra_doors(chooser, private)
    for cell in entrances:
        if not entrance(chooser, cell):
            return None
    add_windows(chooser, windows)
    return storey.with_openings([with_leaf(storey, o, rng) for o in chooser.made])


def zone_of(storey: Storey) -> dict[int, int]:
    """Which zone each cell is part of."""
    return {cell: z for z, group in enumerate(storey.zones) for cell in group}


def tree(storey: Storey, chooser: Chooser, private: dict[int, int], entrances: list[int]) -> list[tuple[int, int]]:
    """R1: which pairs of cells get a door, so that each unit is one piece."""
    zone, graph = zone_of(storey), nx.Graph()
    graph.add_nodes_from(range(len(storey.zones)))
    for k, wall in enumerate(storey.walls):
        i, j = wall.sides
        if wall.outer or storey.cells[i].unit != storey.cells[j].unit or not chooser.room_for(k, 0.75):
            continue
        if not (storey.cells[i].floor and storey.cells[j].floor):
            continue  # nobody steps into a stair's void
        if any(private.get(a, b) != b for a, b in ((i, j), (j, i))):
            continue
        weight = price(storey.cells[i].label, storey.cells[j].label) + 0.2 * chooser.rng.random()
        weight = 0.1 if j == private.get(i) or i == private.get(j) else weight
        if not graph.has_edge(zone[i], zone[j]) or graph[zone[i]][zone[j]]["weight"] > weight:
            graph.add_edge(zone[i], zone[j], weight=weight, cells=(i, j))
    edges = nx.minimum_spanning_edges(graph, data=True)
    found = [data["cells"] for _, _, data in edges]
    units = {c.unit for c in storey.cells}
    return found if nx.number_connected_components(graph) == len(units) else [(-2, -2)]


def price(a: str, b: str) -> float:
    """How unusual a door between two rooms is."""
    kinds = {a, b}
    if kinds & HALLS:
        return 1.0
    if kinds & {"Living_Room"}:
        return 2.5 if kinds & {"Bathroom", "Toilet"} else 2.0
    if kinds & {"Kitchen", "Dining_Room"}:
        return 3.0
    return 5.0 if kinds & {"Bathroom", "Toilet", "Storage"} else 4.0


def width_of(labels: set[str], rng: Generator) -> float:
    """A door's clear width for the rooms it joins."""
    if labels & SMALL:
        return round(float(rng.uniform(0.6, 0.75)), 2)
    return round(float(rng.uniform(0.7, 0.85) if "Bathroom" in labels else rng.uniform(0.75, 1.0)), 2)


def join(chooser: Chooser, a: int, b: int, kind: str = "door") -> bool:
    """Place a door between two cells: a double door or a wide opening between day rooms now and then."""
    storey, rng = chooser.storey, chooser.rng
    if a < 0:
        return False
    labels = {storey.cells[a].label, storey.cells[b].label}
    width = width_of(labels, rng)
    if labels <= HALLS | LIVING and rng.random() < 0.45:
        kind, width = ("opening", rng.uniform(0.9, 1.5)) if rng.random() < 0.5 else ("door", rng.uniform(1.2, 1.6))
    tall = rng.random() < 0.3  # no lintel
    places = [k for k, w in enumerate(storey.walls) if set(w.sides) == {a, b}]
    for k in sorted(places, key=lambda k: -storey.walls[k].length):
        for wide in (round(float(width), 2), 0.8, 0.7, 0.6):
            kind = "door" if wide < 0.9 else kind
            head = storey.height if kind == "opening" and tall and wide <= WIDEST_GAP_M else chooser.heads.door
            if chooser.put(k, wide, kind, 0.0, head):
                return True
    return False


def extra_doors(chooser: Chooser, private: dict[int, int]) -> None:
    """R2."""
    storey, zone = chooser.storey, zone_of(chooser.storey)
    joined = {frozenset(zone[s] for s in storey.walls[o.wall].sides) for o in chooser.made}
    for wall in storey.walls:
        if wall.outer or set(wall.sides) & set(private):
            continue
        i, j = wall.sides
        labels = {storey.cells[i].label, storey.cells[j].label}
        fits = labels <= LIVING | HALLS and storey.cells[i].unit == storey.cells[j].unit
        if fits and frozenset((zone[i], zone[j])) not in joined and zone[i] != zone[j] and chooser.rng.random() < 0.5:
            joined.add(frozenset((zone[i], zone[j])))
            join(chooser, i, j)


def entrance(chooser: Chooser, cell: int) -> bool:
    """R3: the front door from a hall, else from the day rooms of its unit."""
    storey, rng = chooser.storey, chooser.rng
    unit = storey.cells[cell].unit
    ranked = [cell] + [k for k, c in enumerate(storey.cells) if c.unit == unit and c.label in HALLS | LIVING]
    for k in ranked:
        own = [i for i, w in enumerate(storey.walls) if w.outer and k in w.sides]
        for i in rng.permutation(own) if own else []:
            if chooser.put(int(i), round(float(rng.uniform(0.85, 1.1)), 2), "entrance", 0.0, chooser.heads.door):
                return True
    return False


def add_windows(chooser: Chooser, share: float) -> None:
    """R4: one or two windows in most outer walls, the garage's door among them."""
    storey, rng, heads = chooser.storey, chooser.rng, chooser.heads
    for k, wall in enumerate(storey.walls):
        if not wall.outer or wall.height is not None:
            continue
        label = storey.cells[max(wall.sides)].label
        length = chooser.open[k][1] - chooser.open[k][0]
        if label == "Garage" and length > 2.6:
            chooser.put(k, 2.4, "entrance", 0.0, max(heads.door, heads.window), 0.5)
            continue
        if label in NO_WINDOW or rng.random() > share:
            continue
        wet = label in {"Bathroom", "Toilet"}
        for n in range(1 if length < 3.5 or wet else int(rng.integers(1, 3))):
            wide = round(float(rng.uniform(0.5, 0.9) if wet else rng.uniform(0.9, min(2.4, max(1.0, length / 2)))), 2)
            french = not wet and n == 0 and rng.random() < 0.15
            sill = 0.0 if french else float(rng.choice([1.2, 1.4]) if wet else rng.choice([0.75, 0.85, 0.9, 1.0]))
            chooser.put(
                k, wide, "french" if french else "window", sill, heads.window, 0.5 if rng.random() < 0.6 else None
            )


def with_leaf(storey: Storey, opening: Opening, rng: Generator) -> Opening:
    """R5: leaves for a door, whose angle each kind of house chooses for itself."""
    if opening.kind not in {"door", "entrance"}:
        return opening
    count = 2 if opening.width > 1.15 else 1
    options = [
        (h, s) for h in (0, 1) for s in (1, -1) if storey.walls[opening.wall].sides[0 if s == 1 else 1] != OUTSIDE
    ]
    rng.shuffle(options)
    best = max(options, key=lambda o: free_to_swing(storey, opening, o[0], o[1]))
    hinges = (best[0],) if count == 1 else (0, 1)
    return replace(opening, leaves=tuple(Leaf(h, best[1]) for h in hinges))


def free_to_swing(storey: Storey, opening: Opening, hinge: int, swing: int) -> float:
    """Share of the square that a leaf sweeps that lies in the room it swings to."""
    wall = storey.walls[opening.wall]
    shift = swing * (wall.thickness + opening.width) / 2
    square = wall.strip(opening.start - 0.06 * (hinge == 0), opening.end + 0.06 * (hinge == 1), opening.width, shift)
    cell = wall.sides[0 if swing == 1 else 1]
    return float(square.intersection(storey.rooms[cell]).area / square.area)
