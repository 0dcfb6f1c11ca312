"""From the raw segments of a section to the area of its walls: solids and sheets in one file.

The segments of a plane are noded together and cut it into faces. Whether a face is wall is decided face by face,
never component by component: walls may fall into hundreds of open shells (Sweet Home), and one file may hold solid
walls and sheets. Rules, for a face of the arrangement:

R1  it is wall if it is thin: no disc of ``solid_m`` across fits into it. A thin face that is open space is closed all
    round at this height, so nobody gets into it either;
R2  it is solid if it is thick and lies in a closed body: the section's segments wind around it, and a top and a bottom
    lie over and under it (a room of sheets that look outwards has neither). Only what of it is
    thick is massive (a chimney, a slab); the thin rest of the same body is wall, for walls and chimney may be one;
R3  an edge between two faces that are not wall is a sheet, and gets ``sheet_m`` in all, with flat ends; a slit between
    two sheets is no face;
R4  a solid wall thinner than ``sheet_m`` gets as much too: on the 1 cm grid of a plan it would vanish.

R5  Before all that, a mesh of many small faces (a scan) has its noise taken off: a corner every few centimetres would
    make strips too short to be doors of every lintel.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.closets import closets
from pipeline.geometry.cutting import Segments
from pipeline.geometry.overlay import EMPTY, areas, mitred, subtract, united
from pipeline.geometry.regions import opened
from pipeline.geometry.rings import closed_rings, united_rings
from pipeline.geometry.winding import winding_number

GRID_M = 1e-4
"""Segment ends closer than this are one point (lost loops: trimesh #1944, #2224)."""
_OFF_GRID = 0.137
"""Cells of the grid begin here, so that no edge of a cell lies on a round number, where models have their vertices."""
SLIM = 0.9  # of a sheet's thickness: what is thinner gets a sheet's
SLIT_M = 0.01
"""Two sheets that leave a face slimmer than this between them are one: coincident ones do, once turned or rounded."""
TIP_M = 1e-3
DENSE_M = 0.15
"""Shorter segments follow the mesh and not the house, where they are the rule."""
DETAIL_M = 0.01
"""No finer than the grid of a plan."""
BOX_CORNERS = 5  # of a rectangle's closed ring
CRACK_M = 0.02
"""Walls that come closer than this touch."""

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Section:
    """What stands at one height: ``walls`` (R1, R3) and massive ``solids`` (R2), apart, since a slab is no wall.

    ``closets`` are what of the walls is known to be space after all: over the heads of doors it is closed all round.
    """

    walls: BaseGeometry
    solids: BaseGeometry
    closets: BaseGeometry = EMPTY


def section(cut: Segments, *, sheet_m: float, solid_m: float, sheets: bool = True) -> Section:
    """Walls and solids of a plane's segments.

    Without ``sheets`` only closed bodies count: near the floor, a lone edge is the rim of a slab.
    """
    snapped = (np.floor(cut.ends / GRID_M + _OFF_GRID) + 0.5 - _OFF_GRID) * GRID_M
    real = np.any(snapped[:, 0] != snapped[:, 1], axis=1)
    snapped, body = snapped[real], cut.body[real]
    if not len(snapped):
        return Section(EMPTY, EMPTY)
    if _is_dense(snapped):
        return _arranged(replace(cut, ends=snapped, body=body), _drawn(snapped), sheet_m, solid_m, sheets=sheets)
    rings, rest = closed_rings(snapped, body, GRID_M, solid_m / 2)
    if rings is None:
        return _arranged(
            replace(cut, ends=snapped, body=body), shapely.linestrings(snapped), sheet_m, solid_m, sheets=sheets
        )
    strips = shapely.orient_polygons(_strips(rings.polygons(rings.thickness < SLIM * sheet_m), sheet_m))
    thin = united_rings(rings.rings + [shapely.get_coordinates(s)[:-1] for s in strips], CRACK_M)
    if not rest.any():
        return Section(thin, EMPTY)
    loose = replace(cut, ends=snapped[rest], body=body[rest])
    others = _arranged(loose, shapely.linestrings(snapped[rest]), sheet_m, solid_m, sheets=sheets)
    return Section(close_cracks(united([thin, others.walls])), others.solids, others.closets)


def _is_dense(segments: Floats) -> bool:
    """Whether the section follows a mesh of small faces: half of all its length lies in short segments."""
    length = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
    return bool(length[length < DENSE_M].sum() > length.sum() / 2)


def _drawn(segments: Floats) -> npt.NDArray[np.object_]:
    """R5: the segments as lines with as few corners as ``DETAIL_M`` allows."""
    order = np.lexsort((segments[:, :, 1], segments[:, :, 0]), axis=1)
    once = np.unique(np.take_along_axis(segments, order[:, :, None], axis=1), axis=0)  # two sheets may coincide
    merged = shapely.line_merge(shapely.multilinestrings(shapely.linestrings(once)))
    return np.asarray(shapely.simplify(shapely.get_parts(merged), DETAIL_M))


def _not_too_slim(faces: npt.NDArray[np.object_], sheet_m: float) -> npt.NDArray[np.object_]:
    """R4: the faces, and for each that is thinner than ``sheet_m`` a strip of that width along it."""
    slim = 2 * shapely.area(faces) / shapely.length(faces) < SLIM * sheet_m  # of a long strip: its thickness
    return np.concatenate([faces, _strips(faces[slim], sheet_m)]) if slim.any() else faces


def _strips(slim: npt.NDArray[np.object_], sheet_m: float) -> npt.NDArray[np.object_]:
    """Strips ``sheet_m`` wide along those of the faces that are straight."""
    if not len(slim):
        return slim
    boxes = shapely.minimum_rotated_rectangle(slim)
    straight = (shapely.area(slim) > 0.9 * shapely.area(boxes)) & (shapely.get_num_coordinates(boxes) == BOX_CORNERS)
    strips = np.atleast_1d(shapely.buffer(_spines(boxes[straight]), sheet_m / 2, cap_style="flat"))
    return np.asarray(strips[~shapely.is_empty(strips)])


def _spines(boxes: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
    """The long middle lines of rectangles."""
    corners = shapely.get_coordinates(boxes).reshape(-1, BOX_CORNERS, 2)
    middles = (corners[:, :-1] + corners[:, 1:]) / 2
    length = np.hypot(*np.moveaxis(np.diff(corners[:, :3], axis=1), 2, 0))
    first = (length[:, 0] > length[:, 1]).astype(np.int64)
    rows = np.arange(len(boxes))
    return np.atleast_1d(shapely.linestrings(np.stack([middles[rows, first], middles[rows, first + 2]], axis=1)))


def _arranged(
    cut: Segments, drawn: npt.NDArray[np.object_], sheet_m: float, solid_m: float, *, sheets: bool
) -> Section:
    lines = shapely.get_parts(shapely.union_all(drawn, grid_size=GRID_M))
    lines = lines[shapely.get_type_id(lines) == 1]
    faces = shapely.get_parts(shapely.polygonize(lines))
    thick = ~shapely.is_empty(mitred(faces, -solid_m / 2))
    solid = thick.copy()
    solid[thick] = _inside(shapely.point_on_surface(faces[thick]), cut)
    solids = united(faces[solid])
    massive = opened(solids, solid_m)
    thin = ~thick & (2 * shapely.area(faces) / shapely.length(faces) > SLIT_M)
    body = united([*_not_too_slim(faces[thin], sheet_m), opened(subtract(solids, massive), CRACK_M)])
    if not sheets:
        return Section(close_cracks(body), massive)
    closed = united([*faces[thin], solids])
    loose = shapely.difference(shapely.multilinestrings(lines), shapely.buffer(closed, 2 * GRID_M))
    walls = close_cracks(united([body, thicken(loose, sheet_m)]))
    return Section(walls, massive, closets(faces[thin], solids, cut.ends))


def thicken(lines: BaseGeometry, thickness_m: float) -> BaseGeometry:
    """Half the thickness on each side of every line, corners mitred, ends flat (round ones would narrow doors)."""
    if lines.is_empty:
        return EMPTY
    merged = shapely.line_merge(shapely.multilinestrings(shapely.get_parts(lines)))
    tips = _tips(merged)
    if len(tips):
        apart = shapely.difference(merged, shapely.union_all(shapely.buffer(tips, TIP_M)))
        merged = shapely.line_merge(shapely.multilinestrings(shapely.get_parts(apart)))
    return shapely.buffer(merged, thickness_m / 2, cap_style="flat", join_style="mitre", mitre_limit=2.0)


def _tips(lines: BaseGeometry) -> npt.NDArray[np.object_]:
    """Points at which a line turns back on itself, as two sheets do that leave a slit between them."""
    found: list[Floats] = []
    for line in shapely.get_parts(lines):
        points = shapely.get_coordinates(line)
        if line.is_ring:
            points = np.concatenate([points, points[1:2]])
        along = np.diff(points, axis=0)
        length = np.hypot(*along.T)
        back = (along[:-1] * along[1:]).sum(axis=1) < -0.9 * length[:-1] * length[1:]
        found.append(points[1:-1][back])
    return np.atleast_1d(shapely.points(np.concatenate(found))) if found else np.zeros(0, np.object_)


def close_cracks(walls: BaseGeometry, width_m: float = CRACK_M) -> BaseGeometry:
    """Join walls that nearly touch; corners stay as they are."""
    grown = mitred(walls, width_m / 2, limit=3.0)
    return areas(mitred(grown, -width_m / 2, limit=3.0))


def _inside(points: npt.NDArray[np.object_], cut: Segments) -> npt.NDArray[np.bool_]:
    """R2: which points lie in a closed body: all round, above and below."""
    around = winding_number(points, cut.ends) > 0
    around[around] = cut.caps.close(shapely.get_coordinates(points[around]), cut.height)
    return around
