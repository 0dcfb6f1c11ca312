"""Random layouts of homes: cells on a 5 cm grid, as an architect would part a footprint.

R1  A corridor home: rooms on both sides of a corridor, which ends at the living room or at a wall.
R2  A corridor that turns a corner, rooms along all of it.
R3  A hub: the living room in the middle, rooms left and right, a hall at the entrance.
R4  A studio: one large room, a hall, a bathroom, a bedroom or none.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.random import Generator
from shapely import Polygon, box

GRID_M = 0.05


@dataclass
class Draft:
    """A layout in the making: labels and polygons, pairs that no wall parts, cells that are reached from one other."""

    labels: list[str] = field(default_factory=list)
    shapes: list[Polygon] = field(default_factory=list)
    merged: list[tuple[int, int]] = field(default_factory=list)
    private: dict[int, int] = field(default_factory=dict)
    entrance: int = 0

    def add(self, label: str, shape: Polygon) -> int:
        """Add a cell and return its number."""
        self.labels.append(label)
        self.shapes.append(shape)
        return len(self.labels) - 1


def on_grid(value: float) -> float:
    """Round to the grid."""
    return round(value / GRID_M) * GRID_M


def corridor_home(rng: Generator, size: str = "home") -> Draft:
    """R1."""
    width = on_grid(rng.uniform(7.0, 10.0) if size in {"small", "row"} else rng.uniform(9.0, 16.0))
    low, across = on_grid(rng.uniform(2.9, 4.4)), on_grid(rng.uniform(1.2, 1.9))
    high = on_grid(rng.uniform(2.7, 4.2))
    if size == "row":
        low, high = on_grid(rng.uniform(2.2, 2.8)), on_grid(rng.uniform(2.0, 2.6))
    depth, draft = low + across + high, Draft()
    salon = on_grid(rng.uniform(3.8, 5.6)) if rng.random() < 0.75 else 0.0
    start = width - salon
    hall = draft.add(str(rng.choice(["Corridor", "Hallway", "Hall"])), box(0, low, start, low + across))
    if salon:
        living = draft.add("Living_Room", box(start, 0, width, depth))
        if rng.random() < 0.4 and salon > 4.2:
            part = on_grid(depth * rng.uniform(0.55, 0.7))
            draft.shapes[living] = box(start, 0, width, part)
            kitchen = draft.add("Kitchen", box(start, part, width, depth))
            draft.merged += [(living, kitchen)] if rng.random() < 0.6 else []
    need = ["Living_Room"] if not salon else []
    need += ["Kitchen"] if "Kitchen" not in draft.labels else []
    strips = [(0.0, low), (low + across, depth)]
    for (y1, y2), sort in zip(strips, ("day", "night"), strict=True):
        for label, x1, x2 in slices(rng, start, y2 - y1, need if sort == "day" else [], sort):
            draft.add(label, box(x1, y1, x2, y2))
    draft.entrance = hall
    return draft


def corner_home(rng: Generator) -> Draft:
    """R2."""
    low, across, high = (on_grid(rng.uniform(*r)) for r in ((3.0, 4.4), (1.2, 1.7), (3.2, 4.6)))
    left, right = on_grid(rng.uniform(4.0, 7.5)), on_grid(rng.uniform(3.2, 4.6))
    width, depth, draft = left + across + right, low + across + high, Draft()
    hall = box(0, low, left + across, low + across).union(box(left, low, left + across, depth))
    draft.entrance = draft.add(str(rng.choice(["Corridor", "Hallway"])), hall)
    for label, x1, x2 in slices(rng, width, low, ["Living_Room", "Kitchen"], "day"):
        draft.add(label, box(x1, 0, x2, low))
    for label, x1, x2 in slices(rng, left, high, [], "night"):
        draft.add(label, box(x1, low + across, x2, depth))
    for label, y1, y2 in slices(rng, depth - low, right, [], "night"):
        draft.add(label, box(left + across, low + y1, width, low + y2))
    return draft


def slices(rng: Generator, length: float, depth: float, need: list[str], sort: str) -> list[tuple[str, float, float]]:
    """Part a strip into rooms of plausible widths; ``need`` must be among them."""
    widths = {"Bedroom": (2.6, 4.3), "Bathroom": (1.7, 2.7), "Kitchen": (2.4, 3.8), "Living_Room": (3.8, 5.5)}
    widths |= {"Toilet": (1.0, 1.4), "Storage": (1.1, 2.0), "Office": (2.2, 3.4), "Dining_Room": (2.8, 4.0)}
    fill = ["Bedroom", "Bathroom", "Bedroom", "Toilet", "Office", "Storage", "Bedroom"]
    if sort == "day":
        fill = ["Bathroom", "Bedroom", "Dining_Room", "Storage", "Child_Room", "Guest_Room", "Bedroom"]
    labels, used = list(need), sum(widths[n][0] for n in need)
    for label in fill if rng.random() < 0.7 else rng.permutation(fill):
        low, high = widths.get(label, widths["Bedroom"])
        if used + low > length:
            continue
        labels.append(str(label))
        used += low if rng.random() < 0.3 else (low + high) / 2
        if used > length - 1.2:
            break
    labels = [str(v) for v in rng.permutation(labels)] or ["Bedroom"]
    raw = np.array([rng.uniform(*widths.get(label, widths["Bedroom"])) for label in labels])
    small = np.array([label in {"Toilet", "Storage"} for label in labels])
    spare = length - raw.sum()
    if small.all():
        raw *= length / raw.sum()
    else:
        raw[~small] += spare * raw[~small] / raw[~small].sum()
        if raw.min() < 0.95:
            raw = np.full(len(raw), length / len(raw))
    ends = [on_grid(v) for v in np.concatenate([[0.0], np.cumsum(raw)])]
    ends[-1] = length
    return [(label, a, b) for label, a, b in zip(labels, ends[:-1], ends[1:], strict=True) if b - a > 0.8]


def hub(rng: Generator) -> Draft:
    """R3."""
    left, middle, right = (on_grid(rng.uniform(*r)) for r in ((2.8, 4.2), (3.8, 5.8), (2.6, 4.0)))
    depth, draft = on_grid(rng.uniform(7.0, 10.5)), Draft()
    x1, x2, width = left, left + middle, left + middle + right
    foyer = on_grid(rng.uniform(1.5, 2.4))
    narrow = on_grid(middle * rng.uniform(0.45, 1.0)) if rng.random() < 0.5 else middle
    narrow = middle if middle - narrow < 1.2 else narrow
    hall = draft.add(str(rng.choice(["Entryway", "Hall", "Lobby"])), box(x1, 0, x1 + narrow, foyer))
    salon = box(x1, 0, x2, depth).difference(draft.shapes[hall])
    living = draft.add("Living_Room", salon)
    if rng.random() < 0.5:
        part = on_grid(depth - rng.uniform(2.2, 3.0))
        draft.shapes[living] = salon.intersection(box(0, 0, width, part))
        kitchen = draft.add("Kitchen", box(x1, part, x2, depth))
        draft.merged += [(living, kitchen)] if rng.random() < 0.5 else []
    need = [] if "Kitchen" in draft.labels else ["Kitchen"]
    for (a, b), sort in (((0.0, x1), "day"), ((x2, width), "night")):
        for label, y1, y2 in slices(rng, depth, b - a, need, sort):
            draft.add(label, box(a, y1, b, y2))
        need = []
    draft.entrance = hall
    return draft


def studio(rng: Generator) -> Draft:
    """R4."""
    width, depth = on_grid(rng.uniform(5.5, 8.5)), on_grid(rng.uniform(5.0, 6.5))
    bath, hall = on_grid(rng.uniform(1.7, 2.4)), on_grid(rng.uniform(1.3, 2.0))
    draft = Draft()
    draft.entrance = draft.add("Entryway", box(0, 0, hall, depth - bath))
    draft.add("Bathroom", box(0, depth - bath, max(hall, 1.7), depth))
    rest = box(0, 0, width, depth).difference(shapely.union_all(draft.shapes))
    if rng.random() < 0.7 and width - hall > 5.2:
        cut = on_grid(width - rng.uniform(2.4, 3.0))
        draft.add("Bedroom", rest.intersection(box(cut, 0, width, depth)))
        rest = rest.intersection(box(0, 0, cut, depth))
    if rng.random() < 0.5:
        part = on_grid(depth * rng.uniform(0.5, 0.65))
        living = draft.add("Living_Room", rest.intersection(box(0, 0, width, part)))
        kitchen = draft.add("Kitchen", rest.intersection(box(0, part, width, depth)))
        draft.merged.append((living, kitchen))
    else:
        draft.add("Living_Room", rest)
    return draft
