"""The shadow of a body in plan."""

from __future__ import annotations

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.mesh import Mesh
from pipeline.geometry.overlay import EMPTY, areas

EXACT_FACES = 2000
GRID_M = 1e-3


def footprint(mesh: Mesh) -> BaseGeometry:
    """The area that a body covers, square metres of plan; of one with very many faces its convex hull."""
    if not len(mesh.faces):
        return EMPTY
    corners = mesh.vertices[mesh.faces][:, :, :2]
    if len(mesh.faces) > EXACT_FACES:
        return areas(shapely.convex_hull(shapely.multipoints(np.unique(corners.reshape(-1, 2), axis=0))))
    triangles = shapely.polygons(corners)
    return areas(shapely.union_all(triangles[shapely.area(triangles) > 1e-9], grid_size=GRID_M))
