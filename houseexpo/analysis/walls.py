"""Compute walls as polygons (metres): a strip of given thickness around a free space, and all that it encloses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from houseexpo.errors import ConfigError
from houseexpo.tolerances import GRID_M, MITRE, SAME_M2

if TYPE_CHECKING:
    from shapely import MultiPolygon, Polygon


def walls_around(space: Polygon | MultiPolygon, thickness_m: float) -> tuple[Polygon, ...]:
    """Return the walls: the area within ``thickness_m`` metres of the free space that is not free.

    Areas that the free space encloses (pillars, blocks of walls) are walls as a whole, however thick they are. A slit
    of the grid's width that alone joins two parts of the space, as between buildings, is not free.

    Returns
    -------
    Polygons, metres, disjoint and valid, the largest first.

    Raises
    ------
    ConfigError
        The thickness is not a positive number.
    """
    import shapely

    if not (math.isfinite(thickness_m) and thickness_m > 0):
        raise ConfigError(f"walls: expected a thickness of more than 0 m, found {thickness_m!r}")
    core = shapely.buffer(space, -GRID_M, join_style="mitre")
    if shapely.get_num_geometries(core) > shapely.get_num_geometries(space):
        space = shapely.intersection(space, shapely.buffer(core, GRID_M, join_style="mitre"))
    around = shapely.buffer(space, thickness_m, join_style="mitre", mitre_limit=MITRE)
    enclosed = [shapely.Polygon(ring) for part in shapely.get_parts(space) for ring in part.interiors]
    wall = shapely.difference(shapely.union_all([around, *enclosed]), space)
    parts = [part for part in shapely.get_parts(wall) if part.geom_type == "Polygon" and part.area > SAME_M2]
    return tuple(sorted(parts, key=lambda part: (-part.area, part.bounds)))
