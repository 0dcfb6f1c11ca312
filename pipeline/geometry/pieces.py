"""Pieces of a mesh: what is connected by its corners, and whether it is closed."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components


def connected(faces: npt.NDArray[np.int64], n_vertices: int) -> npt.NDArray[np.int64]:
    """For each face (m, 3) a number of the piece that it is connected to by its corners."""
    i, j = np.concatenate([faces[:, :2], faces[:, 1:]]).T
    links = coo_matrix((np.ones(len(i), np.int8), (i, j)), shape=(n_vertices, n_vertices))
    return np.asarray(connected_components(links, directed=False)[1][faces[:, 0]], np.int64)


def closed_pieces(faces: npt.NDArray[np.int64], label: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    """For each piece whether all of its edges have a face on both sides."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    key = edges[:, 0] * (int(faces.max()) + 1) + edges[:, 1]
    _, first, count = np.unique(key, return_index=True, return_counts=True)
    closed = np.ones(int(label.max()) + 1, np.bool_)
    closed[np.tile(label, 3)[first[count < 2]]] = False
    return closed
