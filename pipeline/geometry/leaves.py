"""Doors among the bodies of a mesh that nobody named: leaves, and leaves with their frames.

R1  What a door is made of is thin or hollow (a plate, a frame) or holds such a thing, begins at the floor, ends below
    the ceiling, and is no wider than a door.
R2  Parts that touch and stand parallel belong to one door; together they are as large as one, and no deeper than a
    thick wall. A leaf that stands ajar in its frame, or against another leaf, is one of its own, and so are two
    parallel ones that only a third joins.
R3  Three plates or more side by side in one row are glazing or panelling, and stay wall.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import networkx as nx
import numpy as np
import shapely

from pipeline.geometry.bodies import Bodies, Box, box_around
from pipeline.geometry.doorways import rectangle

WIDTH_M = (0.5, 1.7)
PLATE_M = 0.12
DEEPEST_M = 0.45
TALL_M = 1.7
HIGHEST_M = 3.4
CEILING_M = 0.1
FOOT_M = 0.3
HOLLOW = 0.5
"""A frame fills less than this share of the box around it."""
TOUCH_M = 0.06
SHEET_M = 0.02
IN_ROW_M = 0.2
PARALLEL = np.cos(np.deg2rad(10.0))
SQUARE = np.sin(np.deg2rad(10.0))


@dataclass(frozen=True, eq=False)
class Leaf:
    """What may be a door: the box around it, the bodies that it is made of, and their boxes.

    ``plate_m`` is how thick it is without frames: the metres across the box from the first to the last of its plates.
    """

    box: Box
    bodies: tuple[int, ...]
    parts: tuple[Box, ...]
    plate_m: float


def find_leaves(bodies: Bodies, ceiling_m: float = HIGHEST_M) -> list[Leaf]:
    """All that is shaped as a door; heights count from the level's floor."""
    boxes = {k: bodies.box(k) for k in _likely(bodies, min(ceiling_m - CEILING_M, HIGHEST_M))}
    parts = {k: box for k, box in boxes.items() if _is_part(box, bodies, k)}
    casings = {k: box for k, box in boxes.items() if k not in parts and _is_casing(box, parts.values())}
    parts |= casings
    keys = list(parts)
    found = []
    parallel = [each for members in _touching(keys, parts) for each in _parallel(members, parts)]
    for group in (each for members in parallel for each in _touching(members, parts)):  # R2
        points = [bodies.mesh.vertices[np.unique(bodies.mesh.faces[bodies.faces(k)])] for k in group]
        box = box_around(np.concatenate(points))
        if WIDTH_M[0] <= box.width <= 2 * WIDTH_M[1] and box.thickness <= DEEPEST_M:
            plates = [parts[k] for k in group if k not in casings and _is_plate(parts[k], bodies, k)]
            found.append(Leaf(box, tuple(group), tuple(parts[k] for k in group), _depth(box, plates)))
    return [leaf for leaf in found if not _is_panelling(leaf, found)]


def _touching(keys: list[int], parts: Mapping[int, Box]) -> list[list[int]]:
    """The parts in groups of those that touch."""
    boxes = [parts[k] for k in keys]
    shapes = np.array([rectangle(box, depth=max(box.thickness, 1e-3)) for box in boxes], dtype=object)
    graph = nx.Graph()
    graph.add_nodes_from(range(len(keys)))
    if len(keys) > 1:
        pairs = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=TOUCH_M).T
        graph.add_edges_from(pairs[pairs[:, 0] < pairs[:, 1]].tolist())
    return [sorted(keys[k] for k in group) for group in nx.connected_components(graph)]


def _parallel(group: list[int], parts: Mapping[int, Box]) -> list[list[int]]:
    """A group parted by the directions of its parts; a post belongs to the nearest one square to it, or to none.

    Frames of two doors touch in a corner, and posts stand square to both.
    """
    wide = sorted((k for k in group if parts[k].width >= WIDTH_M[0]), key=lambda k: -parts[k].width)
    parted: list[list[int]] = []
    for k in wide:
        same = [each for each in parted if abs(parts[each[0]].along @ parts[k].along) > PARALLEL]
        if same:
            same[0].append(k)
        else:
            parted.append([k])
    for k in sorted(set(group) - set(wide)):
        square = [each for each in parted if _is_square(parts[each[0]], parts[k])]
        if square:
            min(square, key=lambda each: _distance(parts[each[0]], parts[k])).append(k)
    return [sorted(each) for each in parted] or [group]


def _distance(box: Box, post: Box) -> float:
    """How far a post stands from a plate in plan, metres."""
    return float(rectangle(box).distance(shapely.points(post.centre)))


def _is_square(box: Box, post: Box) -> bool:
    """Whether a post stands parallel to a box or at right angles to it."""
    along = abs(box.along @ post.along)
    return bool(along > PARALLEL or along < SQUARE)


def _is_plate(box: Box, bodies: Bodies, body: int) -> bool:
    """Whether a body fills its box from side to side: a leaf, a pane, a sheet of wall; a frame does not."""
    if box.width < WIDTH_M[0] or box.thickness > DEEPEST_M:
        return False
    corners = bodies.mesh.vertices[bodies.mesh.faces[bodies.faces(body)]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    sides = 1.0 if box.thickness < 1e-3 else 2.0
    return bool(area > HOLLOW * sides * box.width * box.height) and (
        box.thickness < SHEET_M or _volume(bodies, body) > HOLLOW * box.width * box.thickness * box.height
    )


def _depth(box: Box, plates: list[Box]) -> float:
    """From the near face of the first plate to the far face of the last, metres across the box."""
    at = [(float((plate.centre - box.centre) @ box.across), plate.thickness / 2) for plate in plates]
    return max(c + t for c, t in at) - min(c - t for c, t in at) if at else 0.0


def _likely(bodies: Bodies, highest_m: float) -> Iterable[int]:
    low, high = bodies.low, bodies.high
    extent = np.hypot(*(high - low)[:, :2].T)
    tall = (low[:, 2] <= FOOT_M) & (high[:, 2] - low[:, 2] >= TALL_M) & (high[:, 2] <= highest_m)
    return [int(k) for k in np.flatnonzero(tall & (extent <= 1.1 * WIDTH_M[1]))]


def _is_part(box: Box, bodies: Bodies, body: int) -> bool:
    """R1."""
    if box.width > WIDTH_M[1] or box.thickness > DEEPEST_M:
        return False
    if box.thickness <= PLATE_M and box.width >= WIDTH_M[0]:
        return True
    return box.thickness <= TOUCH_M or _volume(bodies, body) < HOLLOW * box.width * box.thickness * box.height


def _is_casing(box: Box, parts: Iterable[Box]) -> bool:
    """R1: whether a box holds a leaf: a frame and its filling drawn as one block."""
    if not (WIDTH_M[0] <= box.width <= WIDTH_M[1] and box.thickness <= DEEPEST_M):
        return False
    return any(_holds(box, part) for part in parts if part.width > 0.7 * box.width)


def _holds(box: Box, part: Box) -> bool:
    to = part.centre - box.centre
    aside = abs(to @ box.across) < box.thickness / 2 and abs(to @ box.along) < 0.15 * box.width
    return bool(aside and abs(box.along @ part.along) > PARALLEL)


def _volume(bodies: Bodies, body: int) -> float:
    corners = bodies.mesh.vertices[bodies.mesh.faces[bodies.faces(body)]]
    corners = corners - corners.reshape(-1, 3).mean(axis=0)
    a, b, c = np.moveaxis(corners, 1, 0)
    return abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())) / 6


def _is_panelling(leaf: Leaf, leaves: list[Leaf]) -> bool:
    """R3: whether a row of plates goes on from this one, or it is one itself."""
    if leaf.box.width > WIDTH_M[1]:
        return _plates(leaf) > 2
    beside = sum(other is not leaf and _in_row(leaf.box, other.box) for other in leaves)
    return beside >= 2


def _plates(leaf: Leaf) -> int:
    """How many parts of a leaf's width stand side by side in it; a pane in its frame is one with it."""
    wide = [part for part in leaf.parts if part.width >= WIDTH_M[0]]
    at = sorted(float((part.centre - leaf.box.centre) @ leaf.box.along) for part in wide)
    return 1 + int((np.diff(at) > WIDTH_M[0] / 2).sum()) if at else 0


def _in_row(one: Box, other: Box) -> bool:
    to = other.centre - one.centre
    return bool(
        abs(one.along @ other.along) > PARALLEL
        and abs(to @ one.across) < 0.1
        and abs(to @ one.along) < (one.width + other.width) / 2 + IN_ROW_M
    )
