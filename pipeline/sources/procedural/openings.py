"""Doors, entrances and windows: where people would have them, clear of every corner."""

from __future__ import annotations

import networkx as nx
import numpy as np

from pipeline.sources.procedural.borders import Edges, Shared
from pipeline.sources.procedural.values import Cell, Opening, Part, Point

CORNER_M = 0.15  # from a wall's centre line: 0.10 m from its face
_SOCIAL = {"Living_Room", "Dining_Room", "Kitchen", "Hall", "Lobby", "Entryway", "Room"}
_WET = {"Bathroom", "Toilet"}
_NARROW = {"Bathroom", "Toilet", "Storage", "Wardrobe", "Boiler_room", "Balcony", "Loggia"}


def interior_doors(cells: list[Cell], edges: Edges, shared: list[Shared], rng: np.random.Generator) -> list[Opening]:
    """Join all rooms by doors, each pair that people would join first, and some pairs more; shafts get none."""
    graph = nx.Graph()
    for each in shared:
        i, j = each.cells
        if i < j and "shaft" not in {cells[i].use, cells[j].use}:
            clear = each.part[1] - each.part[0] - 2 * CORNER_M
            if clear >= 0.65 and clear > graph.get_edge_data(i, j, {"clear": 0.0})["clear"]:
                graph.add_edge(i, j, clear=clear, border=each, cost=_cost(cells[i], cells[j], rng))
    tree = nx.minimum_spanning_tree(graph, weight="cost")
    doors = []
    for i, j, data in graph.edges(data=True):
        if tree.has_edge(i, j) or (data["cost"] < 2.6 and rng.random() < 0.22):
            width = _door_width(cells[i], cells[j], rng)
            border = data["border"]
            doors.append(Opening("door", *_placed(edges, border.edge, border.part, width, rng), cells=(i, j)))
    return doors


def joins_all(cells: list[Cell], doors: list[Opening]) -> bool:
    """Whether every cell that should have a door can be reached from every other."""
    graph = nx.Graph()
    graph.add_nodes_from(i for i, cell in enumerate(cells) if cell.use not in {"shaft", "garage"})
    graph.add_edges_from(door.cells for door in doors)
    return bool(nx.is_connected(graph))


def entrances(
    cells: list[Cell], edges: Edges, outer: list[tuple[int, Part]], rng: np.random.Generator
) -> list[Opening]:
    """Give the house a front door, sometimes a second one, and each garage its gate."""
    found = []
    fit = [(edge, part) for edge, part in outer if part[1] - part[0] > 1.0 + 2 * CORNER_M]
    ranked = sorted(fit, key=lambda each: _front_cost(cells[edges.cell[each[0]]]) + float(rng.uniform(0, 1.5)))
    ranked = [each for each in ranked if cells[edges.cell[each[0]]].use in {"room", "corridor"}]
    for edge, part in ranked[: 1 + int(rng.random() < 0.25)]:
        place = _placed(edges, edge, part, float(rng.uniform(0.85, 1.0)), rng)
        found.append(Opening("entrance", *place, cells=(int(edges.cell[edge]), None)))
    taken = {edge for edge, _ in ranked[:2]}
    for index, cell in enumerate(cells):
        gates = [e for e in fit if edges.cell[e[0]] == index and e[1][1] - e[1][0] > 2.7 and e[0] not in taken]
        if (cell.use == "garage" or "Garage" in cell.words) and gates:
            edge, part = gates[int(rng.integers(len(gates)))]
            found.append(Opening("entrance", *_placed(edges, edge, part, 2.3, rng), cells=(index, None)))
    return found


def windows(
    cells: list[Cell], edges: Edges, outer: list[tuple[int, Part]], taken: list[Opening], rng: np.random.Generator
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
            width = float(rng.uniform(0.5, 0.75)) * min(part[1] - part[0] - 2 * CORNER_M, 2.6)
            place = _placed(edges, edge, part, width, rng)
            found.append(Opening("window", *place, cells=(int(edges.cell[edge]), None)))
    return found


def _placed(edges: Edges, edge: int, part: Part, width: float, rng: np.random.Generator) -> tuple[Point, Point, float]:
    """Return centre, direction and width of an opening somewhere in a part of an edge, narrower where there is no room.

    Most stand near a corner or in the middle, few just anywhere.
    """
    room = part[1] - part[0] - 2 * CORNER_M
    width = round(min(width, room), 3)
    at = part[0] + CORNER_M + width / 2 + (room - width) * float(rng.choice([0.0, 0.5, 1.0, rng.random()]))
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
