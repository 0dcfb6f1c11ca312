"""Pieces of houses, and the heights at which levels are found in them."""

import trimesh

from pipeline.sources.storeys.levels import find_levels
from tests.builders.meshes import joined

HOUSE = (0.0, 0.0, 8.0, 6.0)
SHELL = ((0.0, 0.0, 8.0, 0.2), (7.8, 0.0, 8.0, 6.0), (0.0, 5.8, 8.0, 6.0), (0.0, 0.0, 0.2, 6.0))
INNER = (4.0, 0.0, 4.2, 6.0)
WALLS = (*SHELL, INNER)


def found(*parts: list[trimesh.Trimesh]) -> list[tuple[float, float]]:
    """(floor, ceiling) of each level."""
    levels = find_levels(joined([each for part in parts for each in part]))
    return [(round(level.floor_z, 3), round(level.ceiling_m, 2)) for level in levels]
