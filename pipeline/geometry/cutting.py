"""Mesh and plane: the raw segments of a horizontal section, oriented so that a solid's inside lies to their left."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import trimesh

from pipeline.values import Mesh

STEEP = 0.5
"""A face whose unit normal has |z| below this is upright: a wall, not a floor, a roof or a slope."""


@dataclass(frozen=True, eq=False)
class Cutter:
    """A mesh made ready for many horizontal cuts.

    ``upright_only`` leaves floors, ceilings and roofs out, so that what is cut above head height is wall.
    """

    mesh: Mesh

    @cached_property
    def _normals(self) -> npt.NDArray[np.float64]:
        a, b, c = (self.mesh.vertices[self.mesh.faces[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1)
        return normal / np.where(length > 0, length, 1.0)[:, None]

    @cached_property
    def _z(self) -> npt.NDArray[np.float64]:
        return np.ascontiguousarray(self.mesh.vertices[:, 2])

    @cached_property
    def _span(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        heights = self._z[self.mesh.faces]
        return heights.min(axis=1), heights.max(axis=1)

    @cached_property
    def _upright(self) -> npt.NDArray[np.bool_]:
        return np.abs(self._normals[:, 2]) < STEEP

    @property
    def heights(self) -> npt.NDArray[np.float64]:
        """(n,) vertex heights, metres above the level's floor."""
        return self._z

    def cut(self, height: float, *, upright_only: bool = False) -> npt.NDArray[np.float64]:
        """Segments (n, 2, 2) of the section at ``height``, metres; the mesh's inside lies to the left of each."""
        low, high = self._span
        crossing = (low < height) & (high > height)
        if upright_only:
            crossing &= self._upright
        faces = np.flatnonzero(crossing)
        if not len(faces):
            return np.zeros((0, 2, 2))
        segments, index = trimesh.intersections.mesh_plane(
            _as_trimesh(self.mesh),
            plane_normal=[0.0, 0.0, 1.0],
            plane_origin=[0.0, 0.0, height],
            return_faces=True,
            local_faces=faces,
            cached_dots=self._z - height,
        )
        segments = segments[:, :, :2]
        along = segments[:, 1] - segments[:, 0]
        normal = self._normals[index]
        # the outward normal must lie to the right of the segment: right of (dx, dy) is (dy, -dx)
        backwards = along[:, 1] * normal[:, 0] - along[:, 0] * normal[:, 1] < 0
        segments[backwards] = segments[backwards, ::-1]
        return np.ascontiguousarray(segments)


def _as_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(vertices=mesh.vertices, faces=mesh.faces, process=False, validate=False)


def merged(*meshes: Mesh | None) -> Mesh:
    """One mesh of several; those that are None are left out."""
    parts = [m for m in meshes if m is not None and len(m.faces)]
    if not parts:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    start = np.cumsum([0] + [len(m.vertices) for m in parts[:-1]])
    return Mesh(
        np.concatenate([m.vertices for m in parts]),
        np.concatenate([m.faces + s for m, s in zip(parts, start, strict=True)]),
    )
