"""Compute the polygon of a doorway, from jamb to jamb and face to face of the wall, from a leaf or an opening.

A leaf, or an opening as a source draws it, gives the place of a door, but not its exact depth and width: leaves are
thinner than the wall, frames leave a few centimetres at the sides, openings stick out of the wall.

R1  A doorway cuts through a wall that is slightly skewed to the leaf. If the wall's parts at the two ends are so far
    out of line that one box would be too deep, the doorway is turned to lie along the wall.
R2  If the ends meet two separate walls, one beside the other, the thinner wall gives the depth of the doorway.
R3  A leaf may lie at a face of the wall, before the hole that it shuts, with no wall in its own line.
R4  Between two walls that cross its line, as at the front of a closet, a door is as deep as a partition: such walls
    measure deeper than any wall between two rooms, and do not go on in line with the door.
R5  A named leaf may lie in a wall without a hole, or at a face of it: the doorway goes through the whole wall. The
    caller has to know that the leaf does not merely stand open there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import median

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
from pipeline.geometry.leaves import LEAF_WIDTH_M, LeafBodies, find_leaves
from pipeline.geometry.meshes import (
    Bodies,
    Box,
    Mesh,
    box_around,
    box_around_polygon,
    box_polygon,
    boxes_around_polygons,
    strips_beside,
)
from pipeline.geometry.openings import Opening
from pipeline.tolerances import (
    AROUND_M,
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
    MOST,
    MOSTLY,
    NEARLY_ALL,
    RUN_M,
    SHEET_M,
    SKEW,
    SLIVER_M,
    SOME,
    STAND_M,
    STONE_WALL_M,
    THICK_WALL_M,
    THIN_WALL_M,
    WALL_M,
)

SAME_SLOPE = 0.04

Floats = npt.NDArray[np.float64]


def fit_into_wall(polygon: Polygon, walls: BaseGeometry) -> Polygon:
    """Return a doorway as drawn by its source, fitted to the faces of its wall; unchanged if no wall is found."""
    found = doorway_around_leaf(box_around_polygon(polygon), walls)
    if found is None:
        return polygon
    drawn = box_polygon(found)
    kept = intersect(drawn, polygon).area > 0.5 * min(drawn.area, polygon.area)
    return drawn if kept else polygon  # the nearer of two walls may be the wrong one


def doorway_around_leaf(box: Box, walls: BaseGeometry) -> Box | None:
    """Return the doorway in which a leaf stands closed, as a box as deep as the wall, or None if there is no doorway.

    Walls meet both ends of the leaf within ``BESIDE_M``, or a wall runs on through the leaf.
    """
    reach = box.width / 2 + BESIDE_M + AROUND_M
    (x, y) = box.centre
    near = clip_to_box(walls, x - reach, y - reach, x + reach, y + reach)
    if near.is_empty:
        return None
    ends = _jambs(box, near) or _jambs_behind(box, near)
    if ends is None:
        return None
    at = np.array([-1.0, 1.0]) * (np.array(ends) + SLIVER_M)
    faces = [face for face in _faces(box, at, near) if face is not None]
    if not faces:
        return None
    if all(f[1] - f[0] > WALL_M for f in faces) and _are_crossing(box, ends, near):  # R4
        faces = [(-depth / 2, depth / 2) for depth in [max(box.thickness, HAND_M)]]
    low, high = min(f[0] for f in faces), max(f[1] for f in faces)
    if high - low > SHEET_M + min(f[1] - f[0] for f in faces):
        turned = _doorway_across(box, ends, faces, near)  # R1
        if turned is not None:
            return turned
        low, high = min(faces, key=lambda f: f[1] - f[0])  # R2
    centre = box.centre + (ends[1] - ends[0]) / 2 * box.along + (low + high) / 2 * box.across
    return Box(centre, box.along, ends[0] + ends[1], high - low, box.low, box.high)


def _are_crossing(box: Box, ends: list[float], walls: BaseGeometry) -> bool:
    """Return whether no wall as deep as its jambs goes on in line with a leaf, on either side."""
    low, high = ends
    beyond = np.array([-low - RUN_M, -low - 2 * RUN_M, high + RUN_M, high + 2 * RUN_M])
    return not any(face is not None and face[1] - face[0] > WALL_M for face in _faces(box, beyond, walls))


def _doorway_across(box: Box, ends: list[float], faces: list[tuple[float, float]], walls: BaseGeometry) -> Box | None:
    """Return the doorway along the wall with these ``faces`` at the ``ends`` of a leaf; None if it is two walls."""
    if len(faces) < 2 or abs(np.ptp(faces[0]) - np.ptp(faces[1])) > STAND_M:
        return None
    at = [-ends[0] - SLIVER_M, ends[1] + SLIVER_M]
    slope = float(np.mean(faces[1]) - np.mean(faces[0])) / (at[1] - at[0])
    middle = (ends[1] - ends[0]) / 2
    aside = float(np.mean(faces[0])) + slope * (middle - at[0])
    if abs(slope) > SKEW or abs(aside) > box.thickness / 2 + SLIVER_M:
        return None
    for end, face in zip(at, faces, strict=True):
        (farther,) = _faces(box, np.array([end + np.sign(end) * THIN_WALL_M]), walls)
        goes_on = None if farther is None else np.sign(end) * (np.mean(farther) - np.mean(face)) / THIN_WALL_M
        if goes_on is not None and abs(goes_on - slope) > SAME_SLOPE:
            return None
    longer = float(np.hypot(1.0, slope))
    centre = box.centre + middle * box.along + aside * box.across
    along = (box.along + slope * box.across) / longer
    depth = float(np.ptp(faces, axis=1).mean()) / longer + 2 * LAP_M  # without the lap, a hair of wall would be left
    return Box(centre, along, sum(ends) * longer, depth, box.low, box.high)


def doorway_in_uncut_wall(box: Box, walls: BaseGeometry) -> Box | None:
    """Return the doorway through the wall that runs on behind a leaf or through it, or None without such a wall."""
    reach = box.width / 2 + AROUND_M
    x, y = box.centre
    near = clip_to_box(walls, x - reach, y - reach, x + reach, y + reach)
    half = box.width / 2 - SLIVER_M
    faces = [face for face in _faces(box, np.linspace(-half, half, LOOKS), near) if face is not None]
    if len(faces) < LOOKS or (np.ptp(faces, axis=0) > SHEET_M).any():
        return None
    low, high = np.median(faces, axis=0).tolist()
    if low > box.thickness / 2 + STAND_M or high < -box.thickness / 2 - STAND_M:
        return None
    return replace(box, centre=box.centre + (low + high) / 2 * box.across, thickness=high - low)


def _jambs(box: Box, walls: BaseGeometry) -> list[float] | None:
    """Return the distances, metres, from the box's centre to the wall at its two ends, or None if an end meets none.

    At each end, three lines are measured: the middle and one to each side.
    """
    half = box.width / 2
    aside_m = 0.3 * min(box.thickness, HAND_M)
    starts = np.tile(box.centre + np.array([[0.0], [-aside_m], [aside_m]]) * box.across, (2, 1))
    on = np.repeat([-box.along, box.along], 3, axis=0)
    along = np.stack([starts + (half - SLIVER_M) * on, starts + (half / 2) * on])
    goes_on = shapely.intersects_xy(walls, along[..., 0], along[..., 1]).all(axis=0)  # a wall runs on through the box
    rays = shapely.linestrings(np.stack([starts + half / 2 * on, starts + (half + BESIDE_M) * on], axis=1))
    hits, ray = shapely.get_coordinates(shapely.intersection(rays, walls), return_index=True)
    away = np.full(6, np.inf)
    np.minimum.at(away, ray, dot_product(hits - starts[ray], on[ray]))
    away[goes_on] = half
    ends = [away[end][np.isfinite(away[end])].tolist() for end in (slice(3), slice(3, 6))]
    if all(len(found) >= 2 or (found and box.thickness < SLIVER_M) for found in ends):
        return [median(found) for found in ends]
    return None


def _jambs_behind(box: Box, walls: BaseGeometry) -> list[float] | None:
    """Return ``_jambs`` for a leaf that lies before the hole at a face of its wall, or None."""
    if box.thickness > HAND_M:
        return None
    for sign in (-1.0, 1.0):
        line = replace(box, centre=box.centre + sign * (box.thickness / 2 + CRACK_M) * box.across, thickness=0.0)
        if not walls.intersects(box_polygon(line, width=MOSTLY * box.width, depth=CRACK_M)):
            ends = _jambs(line, walls)
            if ends is not None:
                return ends
    return None


def _faces(box: Box, at: Floats, walls: BaseGeometry) -> list[tuple[float, float] | None]:
    """Return the offsets, metres, of the wall's two faces across the box, at distances (n,) along it from its centre.

    An entry is None where no wall stands or the wall is thicker than ``STONE_WALL_M``.
    """
    points = box.centre + at[:, None] * box.along
    reach = STONE_WALL_M * box.across
    lines = shapely.linestrings(np.stack([points - reach, points + reach], axis=1))
    parts, line = shapely.get_parts(shapely.intersection(lines, walls), return_index=True)
    corners, part = shapely.get_coordinates(parts, return_index=True)
    across = dot_product(corners - points[line[part]], box.across)
    low, high = np.full(len(parts), np.inf), np.full(len(parts), -np.inf)
    np.minimum.at(low, part, across)
    np.maximum.at(high, part, across)
    best: list[tuple[float, float] | None] = [None] * len(at)
    for k, one, other in zip(line.tolist(), low.tolist(), high.tolist(), strict=True):
        known = best[k]
        if other - one > 1e-3 and (known is None or abs(one + other) < abs(known[0] + known[1])):
            best[k] = (one, other)
    return [None if found is None or found[1] - found[0] > STONE_WALL_M else found for found in best]


# ---------------------------------------------------------------------------------------------------------------------
# Leaves and panes that are one body with their wall: a closed one leaves a recess under its lintel.
# ---------------------------------------------------------------------------------------------------------------------

LOOK_SHARES = np.linspace(-0.4, 0.4, LOOKS)


def leaves_in_recesses(lintels: BaseGeometry, walls: BaseGeometry) -> list[Polygon]:
    """Return doorways made of a thin piece of ``walls``, the leaf, and the slim lintels beside it.

    ``lintels`` hang over free floor. A lintel over an open door is as deep as the wall. A lintel over a recess is
    slimmer, and a leaf as long as the lintel stands beside it. A recess ends at a jamb on both sides; a shelf before a
    wall that goes on makes no recess.
    """
    found = [pair for pair in _door_recesses(lintels, walls, DOORWAY_M) if _has_jambs(pair[0], walls)]
    return polygons_of(
        unite(buffer_mitred(buffer_mitred(unite([leaf, lintel]), CM_M), -CM_M) for lintel, leaf in found)
    )


def _has_jambs(lintel: Polygon, walls: BaseGeometry) -> bool:
    """Return whether wall stands at both ends of a lintel, in line with it."""
    box = box_around_polygon(lintel)
    reach = (box.width / 2 + STAND_M) * box.along
    ends = shapely.points([box.centre - reach, box.centre + reach])
    return bool((shapely.distance(ends, walls) < STAND_M).all())


def glazed_recesses(
    lintels: BaseGeometry, walls: BaseGeometry, panes: Sequence[LeafBodies] = (), *, any_width: bool = False
) -> list[Polygon]:
    """Return the lintels beside full-height glazing (a pane too wide for a door), which count as wall there.

    ``panes`` are the plates of rows, which count whatever their width. With ``any_width`` all doors are known, so a
    pane as wide as a door counts too.
    """
    bare = lintels if any_width else drop_thin_parts(lintels, HAND_M)  # without seams of a ceiling
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
    for k, side in np.argwhere(closed).tolist():  # nothing stands beside an open doorway: it needs no ray
        (lintel, box), sign = slim[k], (-1.0, 1.0)[side]
        x1, y1, x2, y2 = lintel.bounds
        near = clip_to_box(walls, x1 - 0.5, y1 - 0.5, x2 + 0.5, y2 + 0.5)
        thickness = _thickness_beside(box, sign, near)
        if thickness is not None:
            found += [(lintel, leaf) for leaf in _leaf(box, sign, thickness, near)]
    return found


def _places_beside(boxes: Sequence[Box]) -> Shapes:
    """Return the strips (n, 2) that hold all rays of ``_thickness_beside`` on the two long sides of each lintel."""
    widths = [2 * LOOK_SHARES[-1] * box.width + CM_M for box in boxes]
    return strips_beside(boxes, widths, off_m=-CM_M - HALF_CM_M, depth_m=THIN_WALL_M + CM_M)


def _thickness_beside(box: Box, sign: float, walls: BaseGeometry) -> float | None:
    """Return the thickness, metres, of the wall at one long side; None without a wall or if too thick for a leaf."""
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
    """Return the thickness, metres, of the wall that begins at a place; None without a wall or if too thick."""
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
# R1  A leaf between two ends of one wall stands closed in a doorway. Exception: beside one of its ends a lintel as wide
#     as the leaf begins. Then the doorway is under that lintel, and the leaf stands ajar against another wall. A body
#     that stands proud of the wall on both sides (a frame), or has wall above it, is a door in any case.
# R2  Any other leaf is part of a wall if wall hangs over it, or if it ends as high as the walls that it touches and has
#     no handle. Otherwise it stands open, or is furniture if it is too thick for a leaf.
# R3  A leaf that is one body with its wall is found by the recess under its lintel, as above.
# R4  An opening that the source names is a doorway, whatever stands in it. So is a door that it names in a wall. Where
#     the wall leans or bulges, a rest of it thinner than a sheet at a face of the doorway is cut away too.
# R5  A named leaf stands ajar if one of its ends lies at a lintel about as wide, at an angle to it, and no lintel of
#     its own hangs over it. Its free end may come near a crossing wall and so seem to close a doorway.
# R6  A named leaf in a wall without a hole for it, or at a face of that wall, is a door in the wall. Exception: a leaf
#     beside a doorway or a lintel as wide, which may be the open leaf of that doorway.
# ---------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class JudgedLeaves:
    """The judged leaves: doorways, leaves closed or open, numbers of bodies that are wall, furniture (plan areas)."""

    doorways: tuple[Opening, ...]
    leaves: tuple[Polygon, ...]
    walls: tuple[int, ...]
    furniture: BaseGeometry


def judge_leaves(leaves: Sequence[LeafBodies], walls: BaseGeometry, hanging: BaseGeometry) -> JudgedLeaves:
    """Judge the bodies shaped like doors (R1, R2); ``walls`` and ``hanging`` do not contain them."""
    doorways: list[Opening] = []
    found: list[Polygon] = []
    pieces: list[int] = []
    things: list[Polygon] = []
    for leaf in leaves:
        way = doorway_around_leaf(leaf.box, walls)
        plan = box_polygon(leaf.box, depth=max(leaf.box.thickness, SHEET_M))
        over = _is_under_wall(leaf.box, hanging)
        is_wall = leaf.ends_with_walls and not (leaf.has_handle or over)  # R2
        is_proud = way is not None and leaf.box.thickness >= way.thickness + SLIVER_M and leaf.plate_m < way.thickness
        if way is not None and (is_proud or over or not _ends_beside_lintel(leaf.box, hanging)):  # R1
            doorways.append(Opening.closing(box_polygon(way), "door", "leaf"))
            found.append(plan)
        elif over or is_wall:
            pieces += leaf.bodies
        elif leaf.box.thickness <= HAND_M:  # R2
            found.append(plan)
        else:
            things.append(plan)
    return JudgedLeaves(tuple(doorways), tuple(found), tuple(pieces), unite(things))


def _is_under_wall(box: Box, hanging: BaseGeometry) -> bool:
    """Return whether wall hangs over half of a leaf or more."""
    x, y = box.centre
    near = clip_to_box(hanging, x - box.width, y - box.width, x + box.width, y + box.width)
    return bool(intersect(box_polygon(box, depth=SHEET_M), near).area >= MOST * box.width * SHEET_M)


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
    """Return whether a leaf stands ajar at a lintel in ``hanging``."""
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
    """Return all doorways in ``walls`` (R3 to R6), and all leaves; ``named`` and ``doors`` are named by the source."""
    found = [replace(each, polygon=fit_into_wall(each.polygon, walls)) for each in named]
    leaves = list(judged.leaves)
    wayless: list[Box] = []
    for box in (box for mesh in doors for box in _boxes(mesh)):
        leaves.append(box_polygon(box, depth=max(box.thickness, SHEET_M)))
        if _stands_ajar(box, lintels):  # R5
            continue
        way = doorway_around_leaf(box, walls)
        if way is not None:
            found.append(Opening.named(box_polygon(way), has_door=True))
        else:
            wayless.append(box)
    uncut = list(_in_uncut_walls(wayless, walls, lintels, found))
    found += [Opening.named(box_polygon(way), has_door=True) for way in uncut]
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
    """Yield the doorways of named leaves in walls without a hole for them."""
    others = unite([each.polygon for each in known])
    for box in boxes:
        as_large = DOORWAY_M[0] <= box.width <= DOORWAY_M[1] and box.low <= FOOT_M and box.high >= HEAD_M
        beside = shapely.dwithin(box_polygon(box), others, BESIDE_M) or _ends_beside_lintel(box, lintels)
        if as_large and not beside and (way := doorway_in_uncut_wall(box, walls)) is not None:
            yield way


def _may_be_shut(doorways: Sequence[Opening], walls: BaseGeometry) -> npt.NDArray[np.bool_]:
    """Return for which of the doorways (n,) some wall stands right before one of the two faces."""
    boxes = boxes_around_polygons([each.polygon for each in doorways])
    shapely.prepare(walls)
    before = strips_beside(boxes, [box.width - 2 * CRACK_M for box in boxes], off_m=-LAP_M, depth_m=LAP_M + SHEET_M)
    return np.asarray(shapely.intersects(walls, before).any(axis=1), np.bool_)


def _through_wall(doorway: Polygon, walls: BaseGeometry) -> Polygon:
    """Return a doorway, deepened if a layer of wall thinner than ``SHEET_M`` shuts one of its faces (R4)."""
    box = box_around_polygon(doorway)
    x1, y1, x2, y2 = doorway.bounds
    rest = subtract(clip_to_box(walls, x1 - WALL_M, y1 - WALL_M, x2 + WALL_M, y2 + WALL_M), doorway)

    def left(sign: float, start_m: float) -> tuple[float, float]:
        """Return the share of the width that wall shuts in a layer of ``SHEET_M``, and its reach outwards, metres."""
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
    """Return the first of overlapping doorways: a door may be found as an opening, as a leaf and as a recess."""
    kept: list[int] = []
    shapes = np.array([each.polygon for each in doorways], dtype=np.object_)
    meeting = set(map(tuple, shapely.STRtree(shapes).query(shapes, predicate="intersects").T.tolist()))
    for k, shape in enumerate(shapes):
        near = [shapes[j] for j in kept if (k, j) in meeting]
        if not any(intersect(shape, each).area > SOME * min(shape.area, each.area) for each in near):
            kept.append(k)
    return [doorways[k] for k in kept]


def _boxes(mesh: Mesh) -> list[Box]:
    """Return the box of a leaf, or the boxes of its parts if the whole is not a plate (a leaf open in its frame)."""
    whole = box_around(mesh.vertices[mesh.faces].reshape(-1, 3))
    if LEAF_WIDTH_M[0] <= whole.width <= 2 * LEAF_WIDTH_M[1] and whole.thickness <= WALL_M:
        return [whole]
    return [leaf.box for leaf in find_leaves(Bodies.of(mesh))]
