"""Drop cells (rooms connected with each other) below a threshold of area, such as shafts (Algorithm 1, lines 5-8).

The paper lists n = 500 points for this check, and no step of it uses them: labelling covers every point. A cell is a
room together with all rooms that can be reached from it; a small room with a door is part of a larger cell and stays.
"""

from __future__ import annotations

from pipeline.config import CellsConfig
from pipeline.geometry.rooms_and_passages import connected_rooms
from pipeline.values import Spaces


def drop_small_cells(spaces: Spaces, config: CellsConfig) -> Spaces:
    """Drop every cell of less than ``area_m2``."""
    keep, filled = [], 0
    for cell in connected_rooms(spaces):
        if sum(spaces.rooms[k].area for k in cell) < config.area_m2:
            filled += 1
        else:
            keep += cell
    return spaces.keeping(sorted(keep), filled_cells=filled) if filled else spaces
