"""Mesh and plane: the raw segments of a horizontal section, oriented so that a solid's inside lies to their left.

R1  Segments know their body: faces that share vertices (by index) are one. SUNCG writes every slab of a wall as a body
    of its own, and so do most modellers.
R2  A small face that is not upright takes the direction of what is around it: in a scan, a speck of a wall may look
    anywhere, and a wall with a hole at each of these is closed at no height.
R3  A closed body is wall at a height where most of its outline there is of upright faces: a gable has a slope at each
    end, a roof has little else. Of an open one just the upright faces count.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pipeline.geometry.caps import Caps
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.pieces import closed_pieces, connected

STEEP = 0.5
"""A face whose unit normal has |z| below this is upright: a wall, not a floor, a roof or a slope."""

SMALL_M = 0.2
"""A face with shorter edges is judged together with its neighbours."""
WALL_SHARE = 0.7
LYING = 1e-3
"""A face whose unit normal has |z| above this may be a body's top or bottom."""


@dataclass(frozen=True, eq=False)
class Segments:
    """A section: ``ends`` (n, 2, 2) metres, the body's inside to the left of each; ``body`` (n,) numbers the bodies.

    ``height`` and ``caps`` tell what lies over and under a point of it.
    """

    ends: npt.NDArray[np.float64]
    body: npt.NDArray[np.int64]
    height: float
    caps: Caps


@dataclass(frozen=True, eq=False)
class Cutter:
    """A mesh made ready for many horizontal cuts."""

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
        upright = np.abs(self._normals[:, 2]) < STEEP
        low, high = self._span
        stray = np.flatnonzero(~upright & (high - low > 0))
        edges = np.roll(corners := self.mesh.vertices[self.mesh.faces[stray]], -1, axis=1) - corners
        stray = stray[np.linalg.norm(edges, axis=2).max(axis=1) < SMALL_M]
        if len(stray):  # R2
            around = self._around(stray)
            upright[stray] = np.abs(around[:, 2]) < STEEP * np.linalg.norm(around, axis=1)
        return upright

    def _around(self, faces: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
        """Sums (n, 3) of the normals of all faces that share a vertex with each of these, by their area."""
        corners = self.mesh.faces
        a, b, c = (self.mesh.vertices[corners[:, k]] for k in range(3))
        area = np.repeat(np.cross(b - a, c - a), 3, axis=0)
        n = len(self.mesh.vertices)
        at = np.stack([np.bincount(corners.ravel(), area[:, k], n) for k in range(3)], axis=1)
        return np.asarray(at[corners[faces]].sum(axis=1))

    @cached_property
    def _body(self) -> npt.NDArray[np.int64]:
        return connected(self.mesh.faces, len(self.mesh.vertices))

    @property
    def heights(self) -> npt.NDArray[np.float64]:
        """(n,) vertex heights, metres above the level's floor."""
        return self._z

    def cut(self, height: float, *, upright_only: bool = False) -> Segments:
        """The section at ``height``, metres above the level's floor.

        ``upright_only`` leaves floors, ceilings and roofs out, so that what is cut above head height is wall (R3).
        """
        low, high = self._span
        faces = np.flatnonzero((low < height) & (high > height))
        if not len(faces):
            return Segments(np.zeros((0, 2, 2)), np.zeros(0, np.int64), height, self.caps)
        segments = _crossings(self.mesh, faces, height)
        along = segments[:, 1] - segments[:, 0]
        normal = self._normals[faces]
        # the outward normal must lie to the right of the segment: right of (dx, dy) is (dy, -dx)
        backwards = along[:, 1] * normal[:, 0] - along[:, 0] * normal[:, 1] < 0
        segments[backwards] = segments[backwards, ::-1]
        kept = self._of_walls(segments, faces) if upright_only else slice(None)
        return Segments(np.ascontiguousarray(segments[kept]), self._body[faces][kept], height, self.caps)

    def _of_walls(self, segments: npt.NDArray[np.float64], face: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """R3: which segments (n, 2, 2) of these faces are of walls."""
        upright, body = self._upright[face], self._body[face]
        length = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
        count = int(self._body.max()) + 1
        share = np.bincount(body, length * upright, count) / np.maximum(np.bincount(body, length, count), 1e-12)
        return np.asarray(np.where(self._is_closed[body], share[body] > WALL_SHARE, upright), np.bool_)

    @cached_property
    def _is_closed(self) -> npt.NDArray[np.bool_]:
        """Which bodies are closed all round."""
        return closed_pieces(self.mesh.faces, self._body)

    @cached_property
    def caps(self) -> Caps:
        """The faces that are not upright."""
        lying = np.abs(self._normals[:, 2]) > LYING
        return Caps(self.mesh.vertices[self.mesh.faces[lying]])


def _crossings(mesh: Mesh, faces: npt.NDArray[np.int64], height: float) -> npt.NDArray[np.float64]:
    """(n, 2, 2) where the plane crosses these faces, each of which reaches below it and above.

    A vertex at the very height counts as above it. Each edge is crossed from its vertex of lower index, so that faces
    beside each other share the ends of their segments to the last bit.
    """
    corners = mesh.faces[faces]
    z = mesh.vertices[:, 2]
    above = z[corners] >= height
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    rows = np.arange(len(faces))
    ends = np.empty((len(faces), 2, 2))
    for k in (0, 1):
        edge = np.stack([corners[rows, alone], corners[rows, (alone + 1 + k) % 3]])
        low, high = edge.min(axis=0), edge.max(axis=0)
        share = (height - z[low]) / (z[high] - z[low])
        start = mesh.vertices[low, :2]
        ends[:, k] = start + share[:, None] * (mesh.vertices[high, :2] - start)
    return ends


def differing(cut: Segments, other: Segments) -> Segments:
    """Segments of ``cut`` without the bodies that ``other`` cuts in the very same way: upright walls without a hole."""
    bodies = int(max(cut.body.max(initial=0), other.body.max(initial=0))) + 1
    moved = np.abs(_signature(cut, bodies) - _signature(other, bodies)).max(axis=0)
    keep = moved[cut.body] > 1e-6
    return replace(cut, ends=cut.ends[keep], body=cut.body[keep])


def _signature(cut: Segments, bodies: int) -> npt.NDArray[np.float64]:
    """(5, bodies): the number of segments of each body, and sums over their middles that a moved end would change."""
    x, y = cut.ends.sum(axis=1).T
    return np.stack([np.bincount(cut.body, w, bodies) for w in (np.ones(len(x)), x, y, x * x, y * y)])


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
