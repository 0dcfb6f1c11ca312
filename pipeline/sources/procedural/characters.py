"""Walls that spell characters: strokes on a 2 x 4 grid, as people draw them with a floor planner's walls."""

from __future__ import annotations

from typing import Final

import numpy as np
import shapely

from pipeline.sources.procedural.values import Cell, Storey, Wall

# Each stroke joins points (column, row) written as two digits; rows count upward.
_STROKES: Final = {
    "A": "00-04 04-24 24-20 02-22",
    "C": "20-00 00-04 04-24",
    "E": "20-00 00-04 04-24 02-12",
    "F": "00-04 04-24 02-12",
    "H": "00-04 20-24 02-22",
    "I": "10-14",
    "K": "00-04 02-24 02-20",
    "L": "04-00 00-20",
    "M": "00-04 04-12 12-24 24-20",
    "N": "00-04 04-20 20-24",
    "O": "00-04 04-24 24-20 20-00",
    "S": "00-20 20-22 22-02 02-04 04-24",
    "T": "04-24 10-14",
    "U": "04-00 00-20 20-24",
    "V": "04-10 10-24",
    "X": "00-24 04-20",
    "Z": "04-24 24-00 00-20",
    "1": "10-14 03-14",
    "2": "04-24 24-22 22-02 02-00 00-20",
    "4": "04-02 02-22 24-20",
    "5": "24-04 04-02 02-22 22-20 20-00",
    "7": "04-24 24-00",
}


def sign(rng: np.random.Generator) -> Storey:
    """Write three to seven characters with walls that stand free; one nameless room without a floor holds each.

    No ring encloses 2 m2: the largest, an O, is 1.0 by 1.8 m at most.
    """
    text = rng.choice(sorted(_STROKES), size=int(rng.integers(3, 8)))
    wide, high = float(rng.uniform(0.7, 1.0)), float(rng.uniform(1.2, 1.8))
    walls = []
    for index, character in enumerate(text.tolist()):
        for stroke in _STROKES[character].split():
            a, b = (
                np.array([(int(point[0]) / 2 + 1.6 * index) * wide, int(point[1]) / 4 * high])
                for point in stroke.split("-")
            )
            length = float(np.hypot(*(b - a)))
            direction = (b - a) / length
            walls.append(Wall(index, (a[0], a[1]), (direction[0], direction[1]), length, (0.05, 0.05)))
    cells = [Cell(shapely.box(1.6 * k * wide, 0.0, (1.6 * k + 1) * wide, high), ()) for k in range(len(text))]
    return Storey(
        tuple(cells), tuple(walls), has_floor=False, difficulties=("characters",), expected="rejected:characters"
    )
