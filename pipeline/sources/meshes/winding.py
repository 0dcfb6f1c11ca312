"""Wind the closed bodies of a mesh so that their faces look outwards, and draw each face of such a body once.

Viewers draw both sides of a face, so that nobody sees which way it is wound, or that it is there twice. The stages tell
what is massive from what is hollow by the winding (``pipeline.geometry.wall_sections``).

R1  Corners at one place are one, and faces that share an edge with just one other face are one piece with that. Where
    two bodies touch, four faces meet in an edge: two lie on each other, the other two go on in each other.
R2  A piece is closed if as many of its faces run along each of its edges one way as the other.
R3  A closed piece no thicker on average than a wall is a body, and looks outwards. One that is thicker may be rooms
    drawn as a shell, which looks either way, and stays as it is. Two faces that lie on each other are none.
R4  What is drawn once from each side as a whole is wound face by face, each as its neighbours are. If that gives a
    body, the other copies are left out; else all stay. A face on which two bodies touch is there twice, too.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pipeline.geometry.meshes import MAX_FACES, label_pieces, number_places
from pipeline.sources.meshes.scene import Scene
from pipeline.sources.tolerances import DEEPEST_WALL_M, SAME_M, TINY, TURN_RAD
from pipeline.values import Mesh

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


def turn_bodies_outwards(scene: Scene) -> Scene:
    """Return a scene in metres in which each closed body of walls is wound outwards (R3) and drawn once (R4)."""
    faces = scene.mesh.faces
    if not len(faces) or len(faces) > MAX_FACES:
        return scene
    place = number_places(scene.mesh.vertices)
    once, group, is_doubled = _drawn_once(place[faces], int(place.max()) + 1)
    if not len(once):
        return scene
    corners = scene.mesh.vertices[faces[once]]
    edges = _Edges(place[faces[once]], corners)
    piece = edges.pieces()
    flip = edges.flips(is_doubled[once])
    thickness = _thickness(corners, piece, flip)
    thick = np.abs(thickness)
    is_body = edges.are_closed(piece, flip) & (thick > SAME_M) & (thick <= DEEPEST_WALL_M)  # R3
    turned = is_body[piece] & (flip ^ (thickness < 0)[piece])
    single = is_body[piece] & is_doubled[once]
    if not turned.any() and not single.any():
        return scene
    wound = faces.copy()
    wound[once[turned]] = wound[once[turned], ::-1]
    keep = ~np.isin(group, group[once[single]])
    keep[once[single]] = True
    return Scene(Mesh(scene.mesh.vertices, wound[keep]), scene.owner[keep], scene.parts, scene.left_out)


def _drawn_once(place: Indices, places: int) -> tuple[Indices, Indices, Bools]:
    """Look for faces (m, 3) at the same three places.

    Returns
    -------
    once : (k,)
        One of the faces that are drawn from both sides, and all others; but those on which two bodies touch are left
        out.
    group : (m,)
        The same number for faces at the same places.
    is_doubled : (m,)
        Whether a face is of something that is drawn twice as a whole, once from each side (R4).
    """
    low, high = place.min(axis=1), place.max(axis=1)
    middle = place.sum(axis=1) - low - high
    lowest = place.argmin(axis=1)
    forwards = place[np.arange(len(place)), (lowest + 1) % 3] == middle
    key = (low * places + middle) * places + high  # MAX_FACES keeps it below 2**63
    order = np.argsort(key, kind="stable")
    new = np.diff(key[order], prepend=-1) != 0
    group = np.empty(len(place), np.int64)
    group[order] = np.cumsum(new) - 1
    ahead = np.bincount(group, forwards)
    back = np.bincount(group) - ahead
    matched = (ahead == back)[group]
    if not matched.any():
        return np.arange(len(place)), group, matched
    thing = label_pieces(place, places)
    is_doubled = matched & (np.bincount(thing, ~matched, places) == 0)[thing]
    first = np.zeros(len(place), np.bool_)
    first[order[new]] = True  # of equal ones, a stable sort keeps the first in front
    return np.flatnonzero(np.where(is_doubled, first & (ahead % 2 == 1)[group], ~matched)), group, is_doubled


class _Edges:
    """The edges of faces (m, 3) of places: ``face`` (n,) that each is of, whether it runs ``up``, sorted by ``edge``.

    ``one`` and ``other`` (k,) are faces that go on in each other, ``differ`` whether just one of them is turned over.
    """

    def __init__(self, place: Indices, corners: Floats) -> None:
        ends = np.stack([place, np.roll(place, -1, axis=1)], axis=-1).reshape(-1, 2)
        real = np.flatnonzero(ends[:, 0] != ends[:, 1])
        low, high = ends[real].min(axis=1), ends[real].max(axis=1)
        key = low * (int(place.max()) + 1) + high
        order = np.argsort(key, kind="stable")
        side = real[order]
        self.faces, self.face = len(place), side // 3
        self.up = ends[side, 0] == low[order]
        self.edge = np.cumsum(np.diff(key[order], prepend=-1) != 0) - 1
        count = np.bincount(self.edge)
        starts = np.cumsum(count) - count
        four = _touching(starts[count == 4][:, None] + np.arange(4), side, corners)
        pairs = np.concatenate([starts[count == 2][:, None] + [0, 1], four[:, :2], four[:, 2:]])
        self.one, self.other = self.face[pairs].T
        self.differ = self.up[pairs[:, 0]] == self.up[pairs[:, 1]]

    def pieces(self) -> Indices:
        """For each face the number of its piece (R1)."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        links = coo_array((np.ones(len(self.one), np.int8), (self.one, self.other)), shape=(self.faces, self.faces))
        return np.asarray(connected_components(links, directed=False)[1], np.int64)

    def flips(self, chosen: Bools) -> Bools:
        """For each of the chosen faces whether it is turned over where all are wound as the first of their piece."""
        beside: dict[int, list[tuple[int, bool]]] = {}
        kept = chosen[self.one]
        for one, other, differ in zip(
            self.one[kept].tolist(), self.other[kept].tolist(), self.differ[kept].tolist(), strict=True
        ):
            beside.setdefault(one, []).append((other, differ))
            beside.setdefault(other, []).append((one, differ))
        found: dict[int, bool] = {}
        for start in beside:
            if start in found:
                continue
            found[start] = False
            left = [start]
            while left:
                at = left.pop()
                for face, differs in beside[at]:
                    if face not in found:
                        found[face] = found[at] ^ differs
                        left.append(face)
        flips = np.zeros(self.faces, np.bool_)
        flips[[face for face, turned in found.items() if turned]] = True
        return flips

    def are_closed(self, piece: Indices, flip: Bools) -> Bools:
        """For each piece whether it is closed, once some of its faces are turned over (R2)."""
        count = int(piece.max()) + 1
        of = piece[self.face]
        key = self.edge * count + of
        ways = np.where(self.up ^ flip[self.face], 1, -1)
        order = np.argsort(key, kind="stable")
        starts = np.flatnonzero(np.diff(key[order], prepend=-1))
        closed = np.ones(count, np.bool_)
        closed[of[order][starts][np.add.reduceat(ways[order], starts) != 0]] = False
        return closed


def _touching(four: Indices, side: Indices, corners: Floats) -> Indices:
    """Return of the four faces at edges (e, 4) those (k, 4) of which two lie on each other, these two in front.

    ``side`` (n,) says which side of which of the faces ``corners`` (m, 3, 3) each is.
    """
    face, k = side[four] // 3, side[four] % 3
    start, tip = corners[face, k], corners[face, (k + 2) % 3]
    along = corners[face[:, 0], (k[:, 0] + 1) % 3] - start[:, 0]
    along /= np.maximum(np.linalg.norm(along, axis=1), TINY)[:, None]
    to = tip - start
    to -= np.einsum("eki,ei->ek", to, along)[..., None] * along[:, None]
    to /= np.maximum(np.linalg.norm(to, axis=2), TINY)[..., None]
    found = [np.empty((0, 4), np.int64)]
    left = np.ones(len(four), np.bool_)
    for order in ((0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 0, 2), (2, 3, 0, 1)):
        lie = left & (np.linalg.norm(to[:, order[0]] - to[:, order[1]], axis=1) < TURN_RAD)
        left &= ~lie
        found.append(four[lie][:, order])
    return np.concatenate(found)


def _thickness(corners: Floats, piece: Indices, flip: Bools) -> Floats:
    """For each piece twice its volume by its area, metres: the thickness of a slab; below 0 if faces look inwards."""
    size = np.bincount(piece)
    middle = np.stack([np.bincount(piece, corners[:, :, k].mean(axis=1)) for k in range(3)], axis=1) / size[:, None]
    a, b, c = np.moveaxis(corners - middle[piece][:, None], 1, 0)
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6 * np.where(flip, -1, 1)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.asarray(2 * np.bincount(piece, volume) / np.maximum(np.bincount(piece, area), TINY))
