"""Find door leaves among the bodies of a mesh that nobody named."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from pipeline.geometry.areas import dot_product
from pipeline.geometry.groups import connected_groups
from pipeline.geometry.meshes import Bodies, Box, box_around, box_polygon
from pipeline.geometry.prisms import Prisms
from pipeline.tolerances import (
    CM_M,
    CRACK_M,
    FOOT_M,
    HAND_M,
    HEAD_M,
    MM_M,
    MOST,
    MOSTLY,
    PARALLEL,
    PARTITION_M,
    PLACE_M,
    SHOULDERS_M,
    SOME,
    THIN_WALL_M,
    WALL_M,
)

# ---------------------------------------------------------------------------------------------------------------------
# Doors among the bodies of a mesh that nobody named: leaves, and leaves with their frames.
#
# R1  A part of a door is thin or hollow (a plate, a frame) or holds such a part. It begins at the floor, ends below the
#     ceiling, and is no wider than a door.
# R2  Parts that touch and stand parallel belong to one door; together they are as large as a door, and no deeper than a
#     thick wall. A leaf that stands ajar in its frame, or against another leaf, is a door by itself. Two parallel
#     leaves that only a third part joins are two doors. A hollow body that ends with the walls that it touches, above a
#     leaf in it, is not a frame but a short wall with a hole for the leaf.
# R3  Three plates or more side by side in one row are glazing or panelling, and stay wall.
# R4  A plate with a handle is a door, even if it reaches the ceiling or stands in a row (R3). A handle is a small body
#     that begins above a table and ends below a person's eyes, at the face of a plate, near one of its two edges. A
#     pane beside the plate, broader than a post and without a handle, stays wall.
# ---------------------------------------------------------------------------------------------------------------------

LEAF_WIDTH_M = (0.5, 1.7)
HIGHEST_M = 3.4
MEET_M = 0.06
SQUARE_LEAVES = np.sin(np.deg2rad(10.0))


@dataclass(frozen=True, eq=False)
class LeafBodies:
    """A body or bodies shaped like a door: the box around all, the numbers of the bodies, and their boxes.

    ``plate_m`` is the thickness without frames: metres across the box from the first to the last of its plates.
    ``ends_with_walls`` is True if a wall that the leaf touches, wider than a door, ends at the same height.
    """

    box: Box
    bodies: tuple[int, ...]
    parts: tuple[Box, ...]
    plate_m: float
    has_handle: bool = False
    ends_with_walls: bool = False


def find_leaves(bodies: Bodies, ceiling_m: float = HIGHEST_M) -> list[LeafBodies]:
    """Return all bodies shaped like a door (R1 to R4); ``ceiling_m`` counts from the level's floor."""
    return part_from_panelling(find_plates(bodies, ceiling_m))[0]


def find_plates(bodies: Bodies, ceiling_m: float = HIGHEST_M) -> list[LeafBodies]:
    """Return all bodies shaped like a door, plates of panelling included (R1, R2)."""
    boxes = {k: bodies.box(k) for k in _likely(bodies, min(ceiling_m - HAND_M, HIGHEST_M))}
    parts = {k: box for k, box in boxes.items() if _is_part(box, bodies, k)}
    handled = _with_handles(bodies)  # R4
    parts |= handled
    casings = {k: box for k, box in boxes.items() if k not in parts and _is_casing(box, parts.values())}
    parts |= casings
    keys = list(parts)
    found = []
    parallel = [each for members in _touching(keys, parts) for each in _parallel(members, parts)]
    doors = [_without_walls(members, parts, bodies) for members in parallel]
    groups = [each for members in doors for each in _touching(members, parts)]  # R2
    for group in (each for members in groups for each in _apart_from_panes(members, parts, handled)):  # R4
        points = [bodies.mesh.vertices[np.unique(bodies.mesh.faces[bodies.faces(k)])] for k in group]
        box = box_around(np.concatenate(points))
        if LEAF_WIDTH_M[0] <= box.width <= 2 * LEAF_WIDTH_M[1] and box.thickness <= WALL_M:
            plates = [parts[k] for k in group if k not in casings and _is_plate(parts[k], bodies, k)]
            has_handle = any(k in handled for k in group)
            boxes_ = tuple(parts[k] for k in group)
            found.append(
                LeafBodies(box, tuple(group), boxes_, _depth(box, plates), has_handle, _ends_with_walls(box, bodies))
            )
    return found


def _without_walls(group: list[int], parts: Mapping[int, Box], bodies: Bodies) -> list[int]:
    """Return a group of parts without short walls that have a hole for a leaf of the group (R2)."""
    tops = [parts[k].high for k in group if parts[k].width >= LEAF_WIDTH_M[0]]
    above = [k for k in group if parts[k].high > min(tops, default=np.inf) + HAND_M]
    walls = {k for k in above if not _is_plate(parts[k], bodies, k) and _ends_with_walls(parts[k], bodies)}
    return [k for k in group if k not in walls]


def _ends_with_walls(box: Box, bodies: Bodies) -> bool:
    """Return whether a body that stands on the floor, is wider than a door and touches a box ends as high as it."""
    low, high = bodies.low, bodies.high
    wall = (low[:, 2] <= FOOT_M) & (np.abs(high[:, 2] - box.high) <= CRACK_M)
    wall &= (high - low)[:, :2].max(axis=1) > LEAF_WIDTH_M[1]
    near = shapely.box(low[wall, 0], low[wall, 1], high[wall, 0], high[wall, 1])
    return bool(shapely.dwithin(near, box_polygon(box, depth=max(box.thickness, MM_M)), MEET_M).any())


def _with_handles(bodies: Bodies) -> dict[int, Box]:
    """Return the bodies as wide and thick as a door at which a handle sits, with their boxes (R4)."""
    low, high = bodies.low, bodies.high
    size = np.sort(high - low, axis=1)
    small = (size <= (HAND_M, THIN_WALL_M, PLACE_M)).all(axis=1)
    handles = np.flatnonzero(small & (low[:, 2] >= SHOULDERS_M) & (high[:, 2] <= MOSTLY * HEAD_M))
    if not len(handles):
        return {}
    likely = _likely(bodies, HIGHEST_M)
    plans = shapely.box(low[likely, 0], low[likely, 1], high[likely, 0], high[likely, 1])
    grips = shapely.box(low[handles, 0], low[handles, 1], high[handles, 0], high[handles, 1])
    pairs = shapely.STRtree(plans).query(grips, predicate="dwithin", distance=CRACK_M).T
    boxes = {k: bodies.box(k) for k in sorted({likely[j] for _, j in pairs})}
    return {
        k: box
        for k, box in boxes.items()
        if LEAF_WIDTH_M[0] <= box.width <= LEAF_WIDTH_M[1]
        and box.thickness <= WALL_M
        and any(_is_at_edge(bodies, int(handles[i]), box) for i, j in pairs if likely[j] == k)
    }


def _apart_from_panes(group: list[int], parts: Mapping[int, Box], handled: Mapping[int, Box]) -> list[list[int]]:
    """Return a group of parts without the panes beside its plates with a handle, as groups that touch (R4)."""
    doors = [k for k in group if k in handled]
    beside = {k for k in group if doors and not any(_overlap(parts[k], handled[door]) for door in doors)}
    beside -= {k for k in beside if parts[k].width <= HAND_M}
    if not beside:
        return [group]
    return _touching([k for k in group if k not in beside], parts)


def _overlap(one: Box, other: Box) -> bool:
    """Return whether a good part of the narrower of two parallel boxes lies before the other."""
    apart = abs(float(dot_product(one.centre - other.centre, other.along)))
    return bool((one.width + other.width) / 2 - apart > SOME * min(one.width, other.width))


def _is_at_edge(bodies: Bodies, handle: int, box: Box) -> bool:
    """Return whether a body juts out of a face of a plate by more than ``CM_M``, near one of its edges (R4)."""
    points = bodies.mesh.vertices[np.unique(bodies.mesh.faces[bodies.faces(handle)])][:, :2] - box.centre
    along, across = dot_product(points, box.along), dot_product(points, box.across)
    aside = abs(float(along.min() + along.max())) / 2
    out = max(float(across.max()), -float(across.min())) - box.thickness / 2
    return bool(SOME * box.width < aside < box.width / 2 and out > CM_M)


def may_hold_leaves(walls: Prisms, ceiling_m: float) -> bool:
    """Return whether some of the bodies end where leaves do: above a person's head and below the ceiling."""
    return any(HEAD_M <= each.top_m <= ceiling_m - HAND_M for each in walls.bodies)


def _touching(keys: list[int], parts: Mapping[int, Box]) -> list[list[int]]:
    """Return the parts in groups of those that touch."""
    boxes = [parts[k] for k in keys]
    shapes = np.array([box_polygon(box, depth=max(box.thickness, 1e-3)) for box in boxes], dtype=object)
    pairs = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=MEET_M).T.tolist()
    return [sorted(keys[k] for k in group) for group in connected_groups(len(keys), pairs)]


def _parallel(group: list[int], parts: Mapping[int, Box]) -> list[list[int]]:
    """Split a group by the directions of its parts. A post joins the nearest part square to it, if there is one.

    Frames of two doors may touch in a corner, where a post stands square to both.
    """
    wide = sorted((k for k in group if parts[k].width >= LEAF_WIDTH_M[0]), key=lambda k: -parts[k].width)
    parted: list[list[int]] = []
    for k in wide:
        same = [each for each in parted if abs(dot_product(parts[each[0]].along, parts[k].along)) > PARALLEL]
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
    """Return how far a post stands from a plate in plan, metres."""
    return float(box_polygon(box).distance(shapely.points(post.centre)))


def _is_square(box: Box, post: Box) -> bool:
    """Return whether a post stands parallel to a box or at right angles to it."""
    along = abs(dot_product(box.along, post.along))
    return bool(along > PARALLEL or along < SQUARE_LEAVES)


def _is_plate(box: Box, bodies: Bodies, body: int) -> bool:
    """Return whether a body fills its box from side to side, as a leaf, a pane or a sheet of wall does (no frame)."""
    if box.width < LEAF_WIDTH_M[0] or box.thickness > WALL_M:
        return False
    corners = bodies.mesh.vertices[bodies.mesh.faces[bodies.faces(body)]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    sides = 1.0 if box.thickness < 1e-3 else 2.0
    return bool(area > MOST * sides * box.width * box.height) and (
        box.thickness < CRACK_M or _volume(bodies, body) > MOST * box.width * box.thickness * box.height
    )


def _depth(box: Box, plates: list[Box]) -> float:
    """Return the metres across the box from the near face of the first plate to the far face of the last."""
    at = [(float(dot_product(plate.centre - box.centre, box.across)), plate.thickness / 2) for plate in plates]
    return max(c + t for c, t in at) - min(c - t for c, t in at) if at else 0.0


def _likely(bodies: Bodies, highest_m: float) -> list[int]:
    low, high = bodies.low, bodies.high
    extent = np.hypot(*(high - low)[:, :2].T)
    tall = (low[:, 2] <= FOOT_M) & (high[:, 2] - low[:, 2] >= HEAD_M) & (high[:, 2] <= highest_m)
    return [int(k) for k in np.flatnonzero(tall & (extent <= 1.1 * LEAF_WIDTH_M[1]))]


def _is_part(box: Box, bodies: Bodies, body: int) -> bool:
    """Return whether a body is a part of a door: on the floor, below the ceiling, no wider than a door."""
    if box.width > LEAF_WIDTH_M[1] or box.thickness > WALL_M:
        return False
    if box.thickness <= HAND_M and box.width >= LEAF_WIDTH_M[0]:
        return True
    return box.thickness <= MEET_M or _volume(bodies, body) < MOST * box.width * box.thickness * box.height


def _is_casing(box: Box, parts: Iterable[Box]) -> bool:
    """Return whether a box holds a leaf: a frame and its filling drawn as one block."""
    if not (LEAF_WIDTH_M[0] <= box.width <= LEAF_WIDTH_M[1] and box.thickness <= WALL_M):
        return False
    return any(_holds(box, part) for part in parts if part.width > 0.7 * box.width)


def _holds(box: Box, part: Box) -> bool:
    to = part.centre - box.centre
    aside = abs(dot_product(to, box.across)) < box.thickness / 2 and abs(dot_product(to, box.along)) < 0.15 * box.width
    return bool(aside and abs(dot_product(box.along, part.along)) > PARALLEL)


def _volume(bodies: Bodies, body: int) -> float:
    corners = bodies.mesh.vertices[bodies.mesh.faces[bodies.faces(body)]]
    corners = corners - corners.reshape(-1, 3).mean(axis=0)
    a, b, c = np.moveaxis(corners, 1, 0)
    return abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum())) / 6


def part_from_panelling(leaves: list[LeafBodies]) -> tuple[list[LeafBodies], list[LeafBodies]]:
    """Return the leaves, and the rows of three plates or more, from their first plate to their last."""
    pairs = combinations(range(len(leaves)), 2)
    near = (pair for pair in pairs if _in_row(*(leaves[k].box for k in pair)))
    panelling = {k for row in connected_groups(len(leaves), near) if len(row) > 2 for k in row}
    panelling |= {k for k, leaf in enumerate(leaves) if leaf.box.width > LEAF_WIDTH_M[1] and _plates(leaf) > 2}
    panelling -= {k for k, leaf in enumerate(leaves) if leaf.has_handle}
    return [leaf for k, leaf in enumerate(leaves) if k not in panelling], [leaves[k] for k in sorted(panelling)]


def _plates(leaf: LeafBodies) -> int:
    """Return how many plates stand side by side in a leaf; a pane and its frame count as one."""
    wide = [part for part in leaf.parts if part.width >= LEAF_WIDTH_M[0]]
    at = sorted(float(dot_product(part.centre - leaf.box.centre, leaf.box.along)) for part in wide)
    return 1 + int((np.diff(at) > LEAF_WIDTH_M[0] / 2).sum()) if at else 0


def _in_row(one: Box, other: Box) -> bool:
    to = other.centre - one.centre
    return bool(
        abs(dot_product(one.along, other.along)) > PARALLEL
        and abs(dot_product(to, one.across)) < 0.1
        and abs(dot_product(to, one.along)) < (one.width + other.width) / 2 + PARTITION_M
    )
