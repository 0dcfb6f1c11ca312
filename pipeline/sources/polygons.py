"""Polygons of a mesh file into triangles: a convex one as a fan, another by its ears, so that a notch stays open."""

from __future__ import annotations

import manifold3d
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


def triangulated(vertices: Floats, corners: Indices, counts: Indices) -> tuple[Indices, Indices]:
    """Cut polygons into triangles.

    Parameters
    ----------
    vertices : (n, 3)
    corners : (k,)
        The polygons' vertex numbers, one polygon after the other.
    counts : (p,)
        How many corners each has; those with fewer than three give nothing.

    Returns
    -------
    faces : (m, 3)
        In the polygons' order and winding.
    owner : (m,)
        The polygon that each face is of.
    """
    starts = np.cumsum(counts) - counts
    faces, owners = [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)]
    for count in np.unique(counts[counts >= 3]):
        which = np.flatnonzero(counts == count)
        rings = corners[starts[which][:, None] + np.arange(count)]
        fans = np.stack([np.repeat(rings[:, :1], count - 2, axis=1), rings[:, 1:-1], rings[:, 2:]], axis=2)
        notched = _notched(vertices, rings) if count > 3 else np.zeros(len(rings), bool)
        faces.append(fans[~notched].reshape(-1, 3))
        owners.append(np.repeat(which[~notched], count - 2))
        for k in np.flatnonzero(notched):
            ears = _ears(vertices[rings[k]])
            faces.append(rings[k][ears])
            owners.append(np.full(len(ears), which[k]))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(faces)[order], owner[order]


def _notched(vertices: Floats, rings: Indices) -> npt.NDArray[np.bool_]:
    """Tell which rings (p, c) turn against their own normal at some corner."""
    points = vertices[rings]
    ahead = np.roll(points, -1, axis=1) - points
    turns = np.cross(np.roll(ahead, 1, axis=1), ahead)
    normal = np.cross(points - points[:, :1], np.roll(points, -1, axis=1) - points[:, :1]).sum(axis=1)
    along = np.einsum("pcx,px->pc", turns, normal)
    scale = np.einsum("px,px->p", normal, normal)[:, None]
    notched: npt.NDArray[np.bool_] = (along < -1e-9 * scale).any(axis=1)
    return notched


def _ears(ring: Floats) -> Indices:
    """Triangles (m, 3), as indices into one ring (c, 3) that is not convex, seen along its normal."""
    ahead = np.roll(ring, -1, axis=0)
    normal = np.cross(ring - ring[0], ahead - ring[0]).sum(axis=0)
    drop = int(np.abs(normal).argmax())
    flat = np.delete(ring, drop, axis=1)
    if (normal[drop] < 0) != (drop == 1):  # the two axes kept are left-handed about the middle one
        flat = flat * (1.0, -1.0)
    extent = float(np.ptp(flat, axis=0).max()) or 1.0
    return np.asarray(manifold3d.triangulate([flat], epsilon=1e-9 * extent), np.int64).reshape(-1, 3)
