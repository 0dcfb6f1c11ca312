"""Place furniture (at most two pieces a room) and door leaves in a generated storey, or furniture without a house."""

from __future__ import annotations

from typing import Final

import numpy as np
import shapely

from tests.builders.suncg_houses.values import Cell, Opening, PlacedItem

# Width, height, depth of a box, metres; ids that SUNCG gives to no door.
MODELS: Final = {
    "1101": (1.6, 0.5, 2.0),
    "1102": (0.9, 0.45, 1.9),
    "1103": (1.2, 0.75, 0.8),
    "1104": (0.45, 0.9, 0.45),
    "1105": (1.2, 2.0, 0.6),
    "1106": (0.4, 0.8, 0.6),
}
LEAF: Final = "122"
LEAF_SIZE: Final = (0.8, 2.05, 0.04)


def furnish_rooms(cells: list[Cell], openings: list[Opening], rng: np.random.Generator) -> list[PlacedItem]:
    """Put one or two pieces into each room and a leaf into each door."""
    items = []
    for index, cell in enumerate(cells):
        inner = cell.polygon.buffer(-0.4)
        if cell.use == "shaft" or inner.is_empty:
            continue
        for _ in range(int(rng.integers(1, 3))):
            model = sorted(MODELS)[int(rng.integers(len(MODELS)))]
            x1, y1, x2, y2 = inner.bounds
            centre = (float(rng.uniform(x1, x2)), float(rng.uniform(y1, y2)))
            if shapely.contains_xy(inner, *centre):
                items.append(PlacedItem(model, centre, float(rng.integers(4)) * np.pi / 2, index))
    for opening in openings:
        if opening.kind != "window":
            angle = float(np.arctan2(opening.direction[1], opening.direction[0]))
            items.append(PlacedItem(LEAF, opening.centre, angle, opening.cells[0]))
    return items


def furniture_without_house(rng: np.random.Generator) -> list[PlacedItem]:
    """Return furniture without a house round it."""
    models = rng.choice(sorted(MODELS), size=int(rng.integers(4, 15))).tolist()
    return [
        PlacedItem(model, (float(x), float(y)), 0.0, None)
        for model, (x, y) in zip(models, rng.uniform(0, 9, (len(models), 2)), strict=True)
    ]
