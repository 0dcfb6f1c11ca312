"""Faces of a mesh into connected pieces, and pieces that touch into things."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from pipeline.values import Mesh

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

WELD_M = 1e-4


def pieces(mesh: Mesh, faces: Indices) -> list[Indices]:
    """Divide face numbers (k,) into connected pieces; corners closer than WELD_M are one."""
    if not len(faces):
        return []
    corners = mesh.vertices[mesh.faces[faces]].reshape(-1, 3)
    cells = np.round((corners - corners.min(axis=0)) / WELD_M).astype(np.int64)
    _, point = np.unique(cells, axis=0, return_inverse=True)
    point = point.reshape(-1, 3)
    rows, columns = np.repeat(point[:, 0], 2), point[:, 1:].ravel()
    count = int(point.max()) + 1
    graph = coo_array((np.ones(len(rows), np.int8), (rows, columns)), shape=(count, count))
    label = connected_components(graph, directed=False)[1][point[:, 0]]
    return _divided(faces, label)


def things(mesh: Mesh, found: list[Indices], apart_m: float) -> list[Indices]:
    """Unite pieces whose boxes come closer than ``apart_m``: a leaf and its handle, a table and its legs."""
    if len(found) < 2:
        return found
    bounds = np.array([box(mesh, faces) for faces in found])
    flat = shapely.box(bounds[:, 0, 0], bounds[:, 0, 1], bounds[:, 1, 0], bounds[:, 1, 1])
    one, other = shapely.STRtree(flat).query(flat, predicate="dwithin", distance=apart_m)
    gap = np.maximum(bounds[one, 0, 2], bounds[other, 0, 2]) - np.minimum(bounds[one, 1, 2], bounds[other, 1, 2])
    near = gap <= apart_m
    count = len(found)
    graph = coo_array((np.ones(near.sum(), np.int8), (one[near], other[near])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    return [np.concatenate([found[i] for i in group]) for group in _divided(np.arange(count), label)]


def box(mesh: Mesh, faces: Indices) -> Floats:
    """Lowest and highest corner (2, 3) of some faces."""
    corners = mesh.vertices[mesh.faces[faces]].reshape(-1, 3)
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def taken(mesh: Mesh, faces: npt.NDArray[np.bool_] | Indices) -> Mesh:
    """Return the mesh of some faces, with only their own vertices."""
    used, packed = np.unique(mesh.faces[faces], return_inverse=True)
    return Mesh(mesh.vertices[used], packed.reshape(-1, 3).astype(np.int64))


def _divided(values: Indices, label: npt.NDArray[np.int32]) -> list[Indices]:
    order = np.argsort(label, kind="stable")
    return np.split(values[order], np.cumsum(np.bincount(label))[:-1])
