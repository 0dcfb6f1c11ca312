"""Drop cells (rooms connected with each other) below a threshold of area, such as shafts (Algorithm 1, lines 8, 9).

The paper lists n = 500 points for this check, and no step of it uses them: labelling covers every point. A cell is a
room together with all rooms that can be reached from it; a small room with a door is part of a larger cell and stays.

A note counts the other spaces of ``PATCH_M2`` or more that the layout found not to be rooms (a terrace, a void, a
block), so that nothing is left out without a note.
"""

from __future__ import annotations

from dataclasses import replace

from pipeline.config import CellsConfig
from pipeline.geometry.areas import shares_inside, unite
from pipeline.geometry.rooms_and_passages import connected_rooms
from pipeline.tolerances import MOST, PATCH_M2
from pipeline.values import Layout, Spaces


def drop_small_cells(spaces: Spaces, config: CellsConfig, layout: Layout | None = None) -> Spaces:
    """Drop every cell of less than ``area_m2``, and note how many spaces of the ``layout`` are no rooms."""
    if layout is not None:
        large = [space for space in layout.spaces if space.area >= PATCH_M2]
        gone = int((shares_inside(large, unite(layout.rooms)) < MOST).sum())
        spaces = replace(spaces, notes={**spaces.notes, "no_rooms": gone}) if gone else spaces
    keep, filled = [], 0
    for cell in connected_rooms(spaces):
        if sum(spaces.rooms[k].area for k in cell) < config.area_m2:
            filled += 1
        else:
            keep += cell
    return spaces.keeping(sorted(keep), filled_cells=filled) if filled else spaces
