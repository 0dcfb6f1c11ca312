"""Find doorways and door leaves before gaps are searched: named by the source, or shown by a leaf or a recess."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.areas import (
    Shapes,
    buffer_mitred,
    clip_to_box,
    dot_product,
    drop_thin_parts,
    intersect,
    polygons_of,
    subtract,
    unite,
)
from pipeline.geometry.doorways import (
    box_around_polygon,
    box_polygon,
    boxes_around_polygons,
    doorway_around_leaf,
    doorway_in_uncut_wall,
    fit_into_wall,
    strips_beside,
)
from pipeline.geometry.groups import connected_groups
from pipeline.geometry.meshes import Bodies, Box, Mesh, box_around
from pipeline.geometry.openings import Opening
from pipeline.geometry.prisms import Prisms
from pipeline.tolerances import (
    BESIDE_M,
    CM_M,
    CRACK_M,
    DOORWAY_M,
    FOOT_M,
    HALF_CM_M,
    HAND_M,
    HEAD_M,
    IN_ONE_LINE,
    LAP_M,
    LARGELY,
    LOOKS,
    MM_M,
    MOST,
    MOSTLY,
    NEARLY_ALL,
    PARALLEL,
    PARTITION_M,
    PLACE_M,
    SHEET_M,
    SHOULDERS_M,
    SINGLE_DOOR_M,
    SLIVER_M,
    SOME,
    STAND_M,
    THICK_WALL_M,
    THIN_WALL_M,
    WALL_M,
)

# ---------------------------------------------------------------------------------------------------------------------
# Doors among the bodies of a mesh that nobody named: leaves, and leaves with their frames.
#
# R1  What a door is made of is thin or hollow (a plate, a frame) or holds such a thing, begins at the floor, ends below
#     the ceiling, and is no wider than a door.
# R2  Parts that touch and stand parallel belong to one door; together they are as large as one, and no deeper than a
#     thick wall. A leaf that stands ajar in its frame, or against another leaf, is one of its own, and so are two
#     parallel ones that only a third joins. What is hollow, and ends with the walls that it touches above a leaf in it,
#     is no frame, but a short wall with a hole for the leaf.
# R3  Three plates or more side by side in one row are glazing or panelling, and stay wall.
# R4  What has a handle is a door, though it reaches the ceiling or stands in such a row: something small that begins
#     above a table and ends below a person's eyes, at the face of a plate, near one of its two edges. A pane beside
#     it, broader than a post, has no handle and stays wall.
# ---------------------------------------------------------------------------------------------------------------------

LEAF_WIDTH_M = (0.5, 1.7)
HIGHEST_M = 3.4
TOUCH_M = 0.06
SQUARE_LEAVES = np.sin(np.deg2rad(10.0))


@dataclass(frozen=True, eq=False)
class Leaf:
    """What may be a door: the box around it, the bodies that it is made of, and their boxes.

    ``plate_m`` is how thick it is without frames: the metres across the box from the first to the last of its plates.
    ``ends_with_walls`` is True if a wall that it touches, wider than a door, ends at the same height.
    """

    box: Box
    bodies: tuple[int, ...]
    parts: tuple[Box, ...]
    plate_m: float
    has_handle: bool = False
    ends_with_walls: bool = False


def find_leaves(bodies: Bodies, ceiling_m: float = HIGHEST_M) -> list[Leaf]:
    """Return all that is shaped as a door; heights count from the level's floor."""
    return part_from_panelling(find_plates(bodies, ceiling_m))[0]


def find_plates(bodies: Bodies, ceiling_m: float = HIGHEST_M) -> list[Leaf]:
    """Return all that is shaped as a door, or as a plate of panelling (R1, R2)."""
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
                Leaf(box, tuple(group), boxes_, _depth(box, plates), has_handle, _ends_with_walls(box, bodies))
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
    return bool(shapely.dwithin(near, box_polygon(box, depth=max(box.thickness, MM_M)), TOUCH_M).any())


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
    """Return a group of parts as it is, or only what has a handle in it, without the panes beside that (R4)."""
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
    """Return whether a body lies at the face of a plate, no deeper in it than before it, near an edge (R4)."""
    points = bodies.mesh.vertices[np.unique(bodies.mesh.faces[bodies.faces(handle)])][:, :2] - box.centre
    along, across = dot_product(points, box.along), dot_product(points, box.across)
    aside = abs(float(along.min() + along.max())) / 2
    out = max(float(across.max()), -float(across.min())) - box.thickness / 2
    return bool(SOME * box.width < aside < box.width / 2 and out > CM_M)


def may_hold_leaves(walls: Prisms, ceiling_m: float) -> bool:
    """Return whether any of some upright bodies ends where a leaf does: at a person's breast or higher, not above."""
    return any(MIN_M <= each.top_m <= ceiling_m - HAND_M for each in walls.bodies)


def _touching(keys: list[int], parts: Mapping[int, Box]) -> list[list[int]]:
    """Return the parts in groups of those that touch."""
    boxes = [parts[k] for k in keys]
    shapes = np.array([box_polygon(box, depth=max(box.thickness, 1e-3)) for box in boxes], dtype=object)
    pairs = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=TOUCH_M).T.tolist()
    return [sorted(keys[k] for k in group) for group in connected_groups(len(keys), pairs)]


def _parallel(group: list[int], parts: Mapping[int, Box]) -> list[list[int]]:
    """A group parted by the directions of its parts; a post belongs to the nearest one square to it, or to none.

    Frames of two doors touch in a corner, and posts stand square to both.
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
    """Return whether a body fills its box from side to side: a leaf, a pane, a sheet of wall; a frame does not."""
    if box.width < LEAF_WIDTH_M[0] or box.thickness > WALL_M:
        return False
    corners = bodies.mesh.vertices[bodies.mesh.faces[bodies.faces(body)]]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    sides = 1.0 if box.thickness < 1e-3 else 2.0
    return bool(area > MOST * sides * box.width * box.height) and (
        box.thickness < CRACK_M or _volume(bodies, body) > MOST * box.width * box.thickness * box.height
    )


def _depth(box: Box, plates: list[Box]) -> float:
    """From the near face of the first plate to the far face of the last, metres across the box."""
    at = [(float(dot_product(plate.centre - box.centre, box.across)), plate.thickness / 2) for plate in plates]
    return max(c + t for c, t in at) - min(c - t for c, t in at) if at else 0.0


def _likely(bodies: Bodies, highest_m: float) -> list[int]:
    low, high = bodies.low, bodies.high
    extent = np.hypot(*(high - low)[:, :2].T)
    tall = (low[:, 2] <= FOOT_M) & (high[:, 2] - low[:, 2] >= HEAD_M) & (high[:, 2] <= highest_m)
    return [int(k) for k in np.flatnonzero(tall & (extent <= 1.1 * LEAF_WIDTH_M[1]))]


def _is_part(box: Box, bodies: Bodies, body: int) -> bool:
    """R1."""
    if box.width > LEAF_WIDTH_M[1] or box.thickness > WALL_M:
        return False
    if box.thickness <= HAND_M and box.width >= LEAF_WIDTH_M[0]:
        return True
    return box.thickness <= TOUCH_M or _volume(bodies, body) < MOST * box.width * box.thickness * box.height


def _is_casing(box: Box, parts: Iterable[Box]) -> bool:
    """R1: return whether a box holds a leaf: a frame and its filling drawn as one block."""
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


def part_from_panelling(leaves: list[Leaf]) -> tuple[list[Leaf], list[Leaf]]:
    """R3, R4: return the leaves, and the rows of three plates or more, from their first plate to their last."""
    pairs = combinations(range(len(leaves)), 2)
    near = (pair for pair in pairs if _in_row(*(leaves[k].box for k in pair)))
    panelling = {k for row in connected_groups(len(leaves), near) if len(row) > 2 for k in row}
    panelling |= {k for k, leaf in enumerate(leaves) if leaf.box.width > LEAF_WIDTH_M[1] and _plates(leaf) > 2}
    panelling -= {k for k, leaf in enumerate(leaves) if leaf.has_handle}
    return [leaf for k, leaf in enumerate(leaves) if k not in panelling], [leaves[k] for k in sorted(panelling)]


def _plates(leaf: Leaf) -> int:
    """Return how many parts of a leaf's width stand side by side in it; a pane in its frame is one with it."""
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


# ---------------------------------------------------------------------------------------------------------------------
# Doors of cubicles (toilets, changing rooms): lower than any other, in partitions that end below the ceiling.
#
# R1  The leaf is a thin plate that stands on the floor or a little above, as high as a person, and as wide as a door.
# R2  Thin partitions in line with it, or one with a cut-out for it, hold both of its ends. They are higher than the
#     leaf and end below the ceiling; so a headboard or the panel of a desk is none.
# ---------------------------------------------------------------------------------------------------------------------

MIN_M = 1.2


def cubicle_leaves(bodies: Bodies, ceiling_m: float) -> list[Leaf]:
    """Return all that is shaped and held as the door of a cubicle; heights count from the level's floor."""
    return [
        Leaf(box, (k,), (box,), box.thickness)
        for k, box in _cubicle_doors(bodies)
        if _is_held(k, box, bodies, ceiling_m)
    ]


def _cubicle_doors(bodies: Bodies) -> Iterator[tuple[int, Box]]:
    """R1."""
    low, high = bodies.low, bodies.high
    tall = high[:, 2] - low[:, 2]
    extent = np.hypot(*(high - low)[:, :2].T)
    likely = (low[:, 2] <= FOOT_M) & (tall >= MIN_M) & (tall < HEAD_M)
    for k in np.flatnonzero(likely & (extent >= SINGLE_DOOR_M[0]) & (extent <= SINGLE_DOOR_M[1] + SHEET_M)):
        box = bodies.box(int(k))
        if SINGLE_DOOR_M[0] <= box.width <= SINGLE_DOOR_M[1] and box.thickness <= SHEET_M:
            yield int(k), box


def _is_held(plate: int, box: Box, bodies: Bodies, ceiling_m: float) -> bool:
    """R2."""
    low, high = bodies.low, bodies.high
    near = (low[:, :2] <= high[plate, :2] + TOUCH_M).all(axis=1) & (high[:, :2] >= low[plate, :2] - TOUCH_M).all(axis=1)
    near &= (high[:, 2] >= box.high + SHEET_M) & (high[:, 2] <= ceiling_m - HAND_M) & (low[:, 2] < box.high)
    partitions = [box_polygon(each, depth=max(each.thickness, SHEET_M)) for each in _in_line(near, box, bodies)]
    ends = shapely.points([box.centre - box.width / 2 * box.along, box.centre + box.width / 2 * box.along])
    return bool(partitions) and bool((shapely.distance(shapely.multipolygons(partitions), ends) <= TOUCH_M).all())


def _in_line(near: npt.NDArray[np.bool_], box: Box, bodies: Bodies) -> Iterator[Box]:
    """Yield the thin upright boxes among bodies that lie in line with a plate."""
    for k in np.flatnonzero(near):
        each = bodies.box(int(k))
        aside = abs(dot_product(each.centre - box.centre, box.across))
        parallel = abs(dot_product(each.along, box.along)) > IN_ONE_LINE
        if each.thickness <= SHEET_M and aside < SHEET_M and parallel:
            yield each


# ---------------------------------------------------------------------------------------------------------------------
# Leaves and panes that are one body with their wall: what is shut leaves a recess under its lintel.
# ---------------------------------------------------------------------------------------------------------------------

LOOK_SHARES = np.linspace(-0.4, 0.4, LOOKS)

Floats = npt.NDArray[np.float64]


def leaves_in_recesses(lintels: BaseGeometry, walls: BaseGeometry) -> list[Polygon]:
    """Doorways in which a thin piece of ``walls`` stands beside a slim lintel; each is the piece and the lintels by it.

    ``lintels`` is what hangs over free floor. A lintel over an open door is as deep as the wall; one over a recess is
    slimmer, and what stands beside it, as long as it, is the leaf. The recess ends at a jamb on both sides; what hangs
    before a wall that goes on (a shelf, a pile of boards) makes none.
    """
    found = [pair for pair in _door_recesses(lintels, walls, DOORWAY_M) if _has_jambs(pair[0], walls)]
    return polygons_of(unite(_with_lintel(leaf, lintel) for lintel, leaf in found))


def _has_jambs(lintel: Polygon, walls: BaseGeometry) -> bool:
    """Return whether wall stands at both ends of a lintel, in line with it."""
    box = box_around_polygon(lintel)
    reach = (box.width / 2 + STAND_M) * box.along
    ends = shapely.points([box.centre - reach, box.centre + reach])
    return bool((shapely.distance(ends, walls) < STAND_M).all())


def glazed_recesses(
    lintels: BaseGeometry, walls: BaseGeometry, panes: Sequence[Leaf] = (), *, any_width: bool = False
) -> list[Polygon]:
    """Lintels beside a pane too wide for a door: full-height glazing stands there, and the wall is as deep as they.

    ``panes`` are plates of rows, whatever their width. ``any_width``: so is a pane as wide as a door, since all doors
    are known.
    """
    bare = lintels if any_width else drop_thin_parts(lintels, HAND_M)  # without the seams of a ceiling that end at them
    least = DOORWAY_M[0] if any_width else DOORWAY_M[1]
    beside = unite([box_polygon(pane.box, depth=2 * WALL_M) for pane in panes])
    return [
        *(lintel for lintel, _ in _door_recesses(bare, walls, (least, np.inf))),
        *polygons_of(intersect(lintels, beside)),
    ]


def _door_recesses(
    lintels: BaseGeometry, walls: BaseGeometry, width_m: tuple[float, float]
) -> list[tuple[Polygon, Polygon]]:
    """Slim lintels of such widths, each with the thin piece of wall beside it."""
    every = polygons_of(lintels)
    slim = [
        (lintel, box)
        for lintel, box in zip(every, boxes_around_polygons(every), strict=True)
        if CRACK_M <= box.thickness <= THICK_WALL_M
        and width_m[0] <= box.width <= width_m[1]
        and lintel.area >= LARGELY * box.width * box.thickness
    ]
    shapely.prepare(walls)
    closed = shapely.intersects(walls, _places_beside([box for _, box in slim]))
    found = []
    for k, side in np.argwhere(closed).tolist():  # beside an open doorway nothing stands, and no ray need look
        (lintel, box), sign = slim[k], (-1.0, 1.0)[side]
        x1, y1, x2, y2 = lintel.bounds
        near = clip_to_box(walls, x1 - 0.5, y1 - 0.5, x2 + 0.5, y2 + 0.5)
        thickness = _thickness_beside(box, sign, near)
        if thickness is not None:
            found += [(lintel, leaf) for leaf in _leaf(box, sign, thickness, near)]
    return found


def _places_beside(boxes: Sequence[Box]) -> Shapes:
    """Return the strips (n, 2) in which all looks beside the long sides of lintels lie (``_thickness_beside``)."""
    widths = [2 * LOOK_SHARES[-1] * box.width + CM_M for box in boxes]
    return strips_beside(boxes, widths, off_m=-CM_M - HALF_CM_M, depth_m=THIN_WALL_M + CM_M)


def _with_lintel(leaf: Polygon, lintel: Polygon) -> BaseGeometry:
    """A leaf and the lintel beside it as one area."""
    return buffer_mitred(buffer_mitred(unite([leaf, lintel]), CM_M), -CM_M)


def _thickness_beside(box: Box, sign: float, walls: BaseGeometry) -> float | None:
    """Return how thick the wall is that touches one long side, or None if it is none, or too thick for a leaf."""
    across = sign * box.across
    found: list[float] = []
    for looks, share in enumerate(LOOK_SHARES, start=1):
        foot = box.centre + share * box.width * box.along + (box.thickness / 2 - 0.01) * across
        thickness = _thickness_along(foot, across, walls)
        if thickness is not None:
            found.append(thickness)
        elif looks - len(found) > 1:
            return None
    return float(np.median(found))


def _thickness_along(foot: Floats, across: Floats, walls: BaseGeometry) -> float | None:
    """Return how thick the wall is that begins at a place, or None if none does, or one too thick for a leaf."""
    ray = shapely.linestrings([foot, foot + THIN_WALL_M * across])
    parts = [p for p in shapely.get_parts(shapely.intersection(ray, walls)) if p.length > 0]
    if not parts:
        return None
    ends = dot_product(shapely.get_coordinates(parts[0]) - foot, across)
    return float(ends.max() - ends.min()) if ends.min() <= 0.03 and ends.max() <= HAND_M + 0.02 else None


def _leaf(box: Box, sign: float, thickness: float, walls: BaseGeometry) -> list[Polygon]:
    centre = box.centre + sign * box.across * (box.thickness + thickness) / 2
    strip = box_polygon(Box(centre, box.along, box.width, thickness + 0.02, 0.0, 0.0))
    return polygons_of(intersect(strip, walls))[:1]


# ---------------------------------------------------------------------------------------------------------------------
# Doors that are known before any gap is looked at: named by the source, or by the leaf that stands in them.
#
# R1  A leaf that stands proud of the wall on both sides (a frame) is a door.
# R2  A leaf with wall above it that is no thicker than itself is a piece of wall, but for one with a handle, or in a
#     frame of its own as deep as that wall: a door in a thin partition.
# R3  A leaf between two ends of one wall stands closed in a doorway, but not one that ends beside a lintel of its own
#     width: that hangs over the doorway, and the leaf stands ajar against another wall.
# R4  Any other leaf stands open, or is furniture where it is too thick for a leaf. What ends as high as the walls that
#     it touches, and has nothing above it, is a stretch of wall.
# R5  A leaf that is one body with its wall shows by the recess under its lintel, as above.
# R6  An opening that the source names is a doorway, whatever stands in it, and so is a door that it names in a wall.
#     Where the wall leans or bulges, what is left of it before a face of the doorway, thinner than a sheet, goes too.
# R7  A leaf that hangs at the end of a lintel about as wide and stands at an angle to it, with no lintel of its own
#     over it, stands ajar, named or not: its free end may come so near to a crossing wall that it seems to close a
#     doorway.
# R8  A named leaf in a wall without a hole for it, or at the face of one, is a door in that wall all the same, but one
#     beside a doorway or a lintel as wide: it may be the leaf of that, and stand open.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class JudgedLeaves:
    """What the leaves are: doorways, leaves closed or open, bodies that are wall after all, furniture (plan areas)."""

    doorways: tuple[Opening, ...]
    leaves: tuple[Polygon, ...]
    walls: tuple[int, ...]
    furniture: BaseGeometry


def judge_leaves(leaves: Sequence[Leaf], walls: BaseGeometry, hanging: BaseGeometry) -> JudgedLeaves:
    """Judge what is shaped as a door; ``walls`` and ``hanging`` are without it."""
    doorways: list[Opening] = []
    found: list[Polygon] = []
    pieces: list[int] = []
    things: list[Polygon] = []
    for leaf in leaves:
        way = doorway_around_leaf(leaf.box, walls)
        plan = box_polygon(leaf.box, depth=max(leaf.box.thickness, SHEET_M))
        over = _thickness_above(leaf.box, hanging)
        is_wall = leaf.ends_with_walls and not leaf.has_handle and over == 0  # R4
        if leaf.box.thickness <= HAND_M and not is_wall and _stands_ajar(leaf.box, hanging):  # R7
            found.append(plan)
            continue
        if way is not None and leaf.box.thickness >= way.thickness + SLIVER_M and leaf.plate_m < way.thickness:  # R1
            doorways.append(Opening.closing(box_polygon(way), "door", "leaf"))
            found.append(plan)
        elif 0 < over <= 1.25 * max(leaf.plate_m, SHEET_M) and not (_is_framed(leaf, over) or leaf.has_handle):  # R2
            pieces += leaf.bodies
        elif way is not None and (over > 0 or not _ends_beside_lintel(leaf.box, hanging)):  # R3
            doorways.append(Opening.closing(box_polygon(way), "door", "leaf"))
            found.append(plan)
        elif over > 0 or is_wall:
            pieces += leaf.bodies
        elif leaf.box.thickness <= HAND_M:  # R4
            found.append(plan)
        else:
            things.append(plan)
    return JudgedLeaves(tuple(doorways), tuple(found), tuple(pieces), unite(things))


def _is_framed(leaf: Leaf, wall_m: float) -> bool:
    """R2: return whether a leaf stands in a frame that is deeper than itself and at least as deep as the wall above."""
    return len(leaf.bodies) > 1 and leaf.box.thickness > max(leaf.plate_m + CM_M, wall_m - CM_M)


def _thickness_above(box: Box, hanging: BaseGeometry) -> float:
    """Return how thick the wall is over a leaf, metres, or 0 if none is over half of it."""
    x, y = box.centre
    near = clip_to_box(hanging, x - box.width, y - box.width, x + box.width, y + box.width)
    if intersect(box_polygon(box, depth=SHEET_M), near).area < MOST * box.width * SHEET_M:
        return 0.0
    wide = intersect(box_polygon(box, depth=2 * WALL_M), near)
    return float(wide.area / box.width)


def _ends_beside_lintel(box: Box, hanging: BaseGeometry) -> bool:
    """Return whether a lintel about as wide as a leaf begins at one of the leaf's ends."""
    reach = box.width / 2 + THIN_WALL_M
    x, y = box.centre
    near = clip_to_box(hanging, x - reach, y - reach, x + reach, y + reach)
    ends = shapely.points([box.centre - box.width / 2 * box.along, box.centre + box.width / 2 * box.along])
    if near.is_empty:
        return False
    beside = [p for p in polygons_of(hanging) if shapely.distance(ends, p).min() < THIN_WALL_M]
    return any(abs(box_around_polygon(p).width - box.width) < SOME * box.width for p in beside)


def _stands_ajar(box: Box, hanging: BaseGeometry) -> bool:
    """R7."""
    plan = box_polygon(box, depth=max(box.thickness, SHEET_M))
    ends = shapely.points([box.centre - box.width / 2 * box.along, box.centre + box.width / 2 * box.along])
    parts = [p for p in polygons_of(hanging) if shapely.distance(p, plan) < THIN_WALL_M]
    lintels = [(p, box_around_polygon(p)) for p in parts]
    own = any(abs(dot_product(lintel.along, box.along)) > IN_ONE_LINE and p.intersects(plan) for p, lintel in lintels)
    return not own and any(
        shapely.distance(ends, p).min() < THIN_WALL_M
        and abs(dot_product(lintel.along, box.along)) < IN_ONE_LINE
        and abs(lintel.width - box.width) < SOME * box.width
        for p, lintel in lintels
    )


def find_known_doorways(
    named: Iterable[Opening], doors: Iterable[Mesh], walls: BaseGeometry, lintels: BaseGeometry, judged: JudgedLeaves
) -> tuple[list[Opening], list[Polygon]]:
    """All doorways in ``walls`` as they stand, and the leaves, closed or open; ``doors`` are those the source names."""
    found = [replace(each, polygon=fit_into_wall(each.polygon, walls)) for each in named]
    leaves = list(judged.leaves)
    wayless: list[Box] = []
    for box in (box for mesh in doors for box in _boxes(mesh)):
        leaves.append(box_polygon(box, depth=max(box.thickness, SHEET_M)))
        if _stands_ajar(box, lintels):  # R7
            continue
        way = doorway_around_leaf(box, walls)
        if way is not None:
            found.append(Opening.named(box_polygon(way), has_door=True))
        else:
            wayless.append(box)
    found += [Opening.named(box_polygon(way), has_door=True) for way in _in_uncut_walls(wayless, walls, lintels, found)]
    found += judged.doorways
    found = [
        replace(each, polygon=_through_wall(each.polygon, walls)) if is_shut else each
        for each, is_shut in zip(found, _may_be_shut(found, walls), strict=True)
    ]
    found += [Opening.closing(strip, "door", "recess") for strip in leaves_in_recesses(lintels, walls)]
    return _each_once(found), leaves


def _in_uncut_walls(
    boxes: Sequence[Box], walls: BaseGeometry, lintels: BaseGeometry, known: Sequence[Opening]
) -> Iterator[Box]:
    """R8: yield the doorways of named leaves in walls without a hole for them."""
    others = unite([each.polygon for each in known])
    for box in boxes:
        as_large = DOORWAY_M[0] <= box.width <= DOORWAY_M[1] and box.low <= FOOT_M and box.high >= HEAD_M
        beside = shapely.dwithin(box_polygon(box), others, BESIDE_M) or _ends_beside_lintel(box, lintels)
        if as_large and not beside and (way := doorway_in_uncut_wall(box, walls)) is not None:
            yield way


def _may_be_shut(doorways: Sequence[Opening], walls: BaseGeometry) -> npt.NDArray[np.bool_]:
    """Return before which of the doorways (n,) some wall stands, right at one of the two faces."""
    boxes = boxes_around_polygons([each.polygon for each in doorways])
    shapely.prepare(walls)
    before = strips_beside(boxes, [box.width - 2 * CRACK_M for box in boxes], off_m=-LAP_M, depth_m=LAP_M + SHEET_M)
    return np.asarray(shapely.intersects(walls, before).any(axis=1), np.bool_)


def _through_wall(doorway: Polygon, walls: BaseGeometry) -> Polygon:
    """Return a doorway, so much deeper that no wall thinner than ``SHEET_M``, nor a hair of it, shuts it (R6)."""
    box = box_around_polygon(doorway)
    x1, y1, x2, y2 = doorway.bounds
    rest = subtract(clip_to_box(walls, x1 - WALL_M, y1 - WALL_M, x2 + WALL_M, y2 + WALL_M), doorway)

    def left(sign: float, start_m: float) -> tuple[float, float]:
        """Return the share of the width that wall shuts in a layer of ``SHEET_M``, and how far it reaches, metres."""
        middle = box.centre + sign * box.across * (box.thickness / 2 + start_m + SHEET_M / 2)
        strip = box_polygon(replace(box, centre=middle), width=box.width - 2 * CRACK_M, depth=SHEET_M)
        shut, far = 0.0, 0.0
        for part in shapely.get_parts(shapely.intersection(strip, rest)):
            if part.is_empty:
                continue
            corners = shapely.get_coordinates(part) - box.centre
            shut += float(np.ptp(dot_product(corners, box.along)))
            far = max(far, float(dot_product(corners, sign * box.across).max()) - box.thickness / 2)
        return shut / box.width, far

    grown = []
    for sign in (-1.0, 1.0):
        shut, far = left(sign, -LAP_M)
        grown.append(far + LAP_M if shut > NEARLY_ALL and left(sign, SHEET_M)[0] < SOME else 0.0)
    if box.width < DOORWAY_M[0] or not any(grown):
        return doorway
    middle = box.centre + box.across * (grown[1] - grown[0]) / 2
    return box_polygon(replace(box, centre=middle), depth=box.thickness + sum(grown))


def _each_once(doorways: list[Opening]) -> list[Opening]:
    """Return one doorway for the opening of a door, its leaf and its recess: the first stands for the others."""
    kept: list[int] = []
    shapes = np.array([each.polygon for each in doorways], dtype=np.object_)
    meeting = set(map(tuple, shapely.STRtree(shapes).query(shapes, predicate="intersects").T.tolist()))
    for k, shape in enumerate(shapes):
        near = [shapes[j] for j in kept if (k, j) in meeting]
        if not any(intersect(shape, each).area > SOME * min(shape.area, each.area) for each in near):
            kept.append(k)
    return [doorways[k] for k in kept]


def _boxes(mesh: Mesh) -> list[Box]:
    """Return the box of a leaf, or those of its parts where it is no plate as a whole (a leaf open in its frame)."""
    whole = box_around(mesh.vertices[mesh.faces].reshape(-1, 3))
    if LEAF_WIDTH_M[0] <= whole.width <= 2 * LEAF_WIDTH_M[1] and whole.thickness <= WALL_M:
        return [whole]
    return [leaf.box for leaf in find_leaves(Bodies.of(mesh))]
