"""Hold a mesh file's triangles as one mesh (``MeshScene``), each with the names of its nodes, mesh and material."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property

import manifold3d
import numpy as np
import numpy.typing as npt

from pipeline.sources.tolerances import SCARCELY, SKY_HEIGHTS, STRAY_REACH, TINY
from pipeline.values import Mesh

Owners = npt.NDArray[np.int32]


@dataclass(frozen=True)
class PartNames:
    """What a file calls a piece: ``groups`` from the outermost to the piece's own node, its mesh, its material."""

    groups: tuple[str, ...] = ()
    mesh: str = ""
    material: str = ""

    def matches(self, patterns: Sequence[str]) -> bool:
        """Return whether one of the part's names is like one of the patterns, large and small letters told apart."""
        names = (*self.groups, self.mesh, self.material)
        return any(fnmatchcase(name, pattern) for pattern in patterns for name in names)


@dataclass(frozen=True, eq=False)
class NamedPiece:
    """A part and its triangles: ``vertices`` (n, 3), ``faces`` (m, 3), both in the scene's frame."""

    part: PartNames
    vertices: npt.NDArray[np.float64]
    faces: npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MeshScene:
    """All triangles as one mesh; ``owner`` (m,) is the index of each face's part in ``parts``."""

    mesh: Mesh
    owner: Owners
    parts: tuple[PartNames, ...]
    left_out: str = ""
    """What could not be read, in words."""

    @classmethod
    def of(cls, pieces: Iterable[NamedPiece]) -> MeshScene:
        """Put pieces together in their order."""
        vertices, faces = [np.empty((0, 3))], [np.empty((0, 3), np.int64)]
        owners = [np.empty(0, np.int32)]
        parts: list[PartNames] = []
        offset = 0
        for piece in pieces:
            vertices.append(piece.vertices)
            faces.append(piece.faces + offset)
            owners.append(np.full(len(piece.faces), len(parts), np.int32))
            parts.append(piece.part)
            offset += len(piece.vertices)
        return cls(Mesh(np.concatenate(vertices), np.concatenate(faces)), np.concatenate(owners), tuple(parts))

    def without(self, patterns: Sequence[str]) -> MeshScene:
        """Leave out the parts of which a node's, group's, mesh's or material's name matches a pattern (``Lamp*``)."""
        if not patterns:
            return self
        keep = ~np.array([part.matches(patterns) for part in self.parts], np.bool_)[self.owner]
        return self.of_faces(keep, self.left_out)

    def unknown_names(self, patterns: Sequence[str]) -> list[str]:
        """Return the patterns that no name of a node, group, mesh or material matches."""
        return [pattern for pattern in patterns if not any(part.matches([pattern]) for part in self.parts)]

    def without_strays(self) -> MeshScene:
        """Leave out the faces that reach ``STRAY_REACH`` times as far as nine in ten corners: damage, or a sun."""
        if not len(self.mesh.faces):
            return self
        away = np.abs(self.mesh.vertices - np.median(self.mesh.vertices, axis=0)).max(axis=1)
        reach = np.quantile(away, 0.9, method="lower")
        keep = (away <= STRAY_REACH * reach)[self.mesh.faces].all(axis=1)
        if keep.all() or not reach:
            return self
        return self.of_faces(keep, self._also_left_out(f"{(~keep).sum()} faces that reach far away"))

    def without_sky(self) -> MeshScene:
        """Leave out a part that is a ball, or a dome, around all others and several times as high: the sky of a scene.

        A dome over a room is not so high over what is in it.
        """
        if len(self.parts) < 2 or not len(self.mesh.faces):
            return self
        of_part = self.owner == np.maximum(self.part_sizes, 0.0).sum(axis=1).argmax()  # no part in a ball is as large
        if not of_part.all() and self._is_around(of_part):
            return self.of_faces(~of_part, self._also_left_out("a ball around it all: the sky"))
        return self

    @cached_property
    def part_boxes(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Lowest and highest corner (p, 3) of each part; infinity and minus infinity where it has no face."""
        low, high = np.full((len(self.parts), 3), np.inf), np.full((len(self.parts), 3), -np.inf)
        order = np.argsort(self.owner, kind="stable")
        owner, corners = self.owner[order], self.mesh.vertices[self.mesh.faces[order]]
        starts = np.flatnonzero(np.diff(owner, prepend=-1))
        if len(starts):
            low[owner[starts]] = np.minimum.reduceat(corners.min(axis=1), starts)
            high[owner[starts]] = np.maximum.reduceat(corners.max(axis=1), starts)
        return low, high

    @property
    def part_sizes(self) -> npt.NDArray[np.float64]:
        """Sizes (p, 3) of the boxes around the parts; minus infinity where one has no face."""
        low, high = self.part_boxes
        return high - low

    def _also_left_out(self, what: str) -> str:
        return "; ".join(filter(None, (self.left_out, what)))

    def _is_around(self, faces: npt.NDArray[np.bool_]) -> bool:
        """Tell whether some faces lie on a ball that holds all other corners."""
        corners = self.mesh.vertices[self.mesh.faces[faces]]
        ball = np.unique(corners.reshape(-1, 3), axis=0)
        rows = np.column_stack([2 * ball, np.ones(len(ball))])
        fit = np.linalg.lstsq(rows, (ball**2).sum(axis=1), rcond=None)[0]
        radius = float(np.sqrt(max(fit[3] + fit[:3] @ fit[:3], 0.0)))
        away = np.linalg.norm(np.concatenate([ball, corners.mean(axis=1)]) - fit[:3], axis=1)
        if (np.abs(away - radius) > SCARCELY * radius).any():  # the corners of a box lie on one, but not its sides
            return False
        rest = self.mesh.vertices[np.unique(self.mesh.faces[~faces])]
        inside = np.linalg.norm(rest - fit[:3], axis=1).max() < radius
        return bool(inside and np.ptp(rest, axis=0).min() * SKY_HEIGHTS < radius)

    def of_faces(self, keep: npt.NDArray[np.bool_], left_out: str = "") -> MeshScene:
        """Return the faces of a mask (m,) with the vertices that they need."""
        used, packed = np.unique(self.mesh.faces[keep], return_inverse=True)
        mesh = Mesh(self.mesh.vertices[used], packed.reshape(-1, 3).astype(np.int64))
        return MeshScene(mesh, self.owner[keep], self.parts, left_out)


def transform_triangles(
    vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64], matrix: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Put triangles at their place by a (4, 4) matrix; a mirroring one turns the faces over."""
    if np.array_equal(matrix, np.eye(4)):
        return vertices, faces
    points = vertices @ matrix[:3, :3].T + matrix[:3, 3]
    return points, faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0 else faces


# Polygons of a mesh file into triangles: a convex one as a fan, another by its ears, so that a notch stays open.


Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]


def triangulate_polygons(vertices: Floats, corners: Indices, counts: Indices) -> tuple[Indices, Indices]:
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
    if (counts == 3).all():
        return corners.reshape(-1, 3), np.arange(len(counts))
    starts = np.cumsum(counts) - counts
    faces, owners = [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)]
    for count in np.unique(counts[counts >= 3]):
        which = np.flatnonzero(counts == count)
        rings = corners[starts[which][:, None] + np.arange(count)]
        fans = np.stack([np.repeat(rings[:, :1], count - 2, axis=1), rings[:, 1:-1], rings[:, 2:]], axis=2)
        notched = _has_notch(vertices, rings) if count > 3 else np.zeros(len(rings), bool)
        faces.append(fans[~notched].reshape(-1, 3))
        owners.append(np.repeat(which[~notched], count - 2))
        for k in np.flatnonzero(notched):
            ears = _ears(vertices[rings[k]])
            faces.append(rings[k][ears])
            owners.append(np.full(len(ears), which[k]))
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(faces)[order], owner[order]


def _has_notch(vertices: Floats, rings: Indices) -> npt.NDArray[np.bool_]:
    """Tell which rings (p, c) turn against their own normal at some corner."""
    points = vertices[rings]
    ahead = np.roll(points, -1, axis=1) - points
    turns = np.cross(np.roll(ahead, 1, axis=1), ahead)
    normal = np.cross(points - points[:, :1], np.roll(points, -1, axis=1) - points[:, :1]).sum(axis=1)
    along = np.einsum("pcx,px->pc", turns, normal)
    scale = np.einsum("px,px->p", normal, normal)[:, None]
    notched: npt.NDArray[np.bool_] = (along < -TINY * scale).any(axis=1)
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
    return np.asarray(manifold3d.triangulate([flat], epsilon=TINY * extent), np.int64).reshape(-1, 3)
