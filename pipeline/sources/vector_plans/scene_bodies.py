"""Turn named bodies of an MJCF, USD or Webots scene into storeys: walls, rooms, doors and furniture by their names.

R1  The names of a body decide, its own first: wall, lintel, column; floor, room, ground; door, doorway, opening,
    window, ceiling. A body without such a name is furniture, and so is the door of a cupboard.
R2  A wall is the plan area of its body between its heights: what begins over a person's knee is a lintel.
R3  A floor with the name of a room, or a number, is a room; one that is only called floor is floor.
R4  A door is the passage of its body; it goes through the wall there. A window is not a passage.
R5  Floors more than STOREYS_APART_M apart are storeys.
R7  Two floors with one name that meet where no wall stands, as the rectangles of an L do, are one room.
R8  Floors that are told apart by numbers alone, of which two meet where no wall stands, are pieces of one floor, and no
    rooms.
R6  A wall whose faces are sheets, and cover nothing, is SHEET_M thick.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.file_kinds import format_suffix
from houseexpo.plan.room_labels import canonical
from pipeline.geometry.areas import buffer_mitred, polygons_of, round_to_grid
from pipeline.sources.drawn_storeys import group_storey_heights
from pipeline.sources.files import LeftOutParts, file_inside
from pipeline.sources.meshes.formats import frame_convention, load_scene
from pipeline.sources.roles import labels_for, names_furniture_with_doors
from pipeline.sources.tolerances import (
    FILE_GRID_M,
    LARGEST_BYTES,
    LARGEST_GRID,
    NARROWEST_DOOR_M,
    UPRIGHT_M2,
    VOXEL_M,
    WIDEST_DOOR_BODY_M,
)
from pipeline.sources.vector_plans.drawing import DrawnStorey, Feature, usual_height
from pipeline.sources.vector_plans.named_features import storey_from_features
from pipeline.tolerances import CRACK_M, HAND_M, KNEE_M, SHEET_M

_MESHES: Final = frozenset({".obj", ".stl", ".dae"})
_KINDS: Final = (
    ("lintel", "wall"),
    ("wall", "wall"),
    ("column", "wall"),
    ("pillar", "wall"),
    ("doorway", "opening"),
    ("doorframe", "opening"),
    ("opening", "opening"),
    ("entrance", "door"),
    ("door", "door"),
    ("cut", "opening"),
    ("window", "window"),
    ("ceiling", "skipped"),
    ("roof", "skipped"),
    ("light", "skipped"),
    ("threshold", "floor"),
    ("room", "floor"),
    ("floor", "floor"),
    ("ground", "skipped"),
    ("furniture", "furniture"),
)
_CORNERS: Final = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
_QUADS: Final = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
_FACES_OF_BOX: Final = np.array([(q[0], q[i], q[i + 1]) for q in _QUADS for i in (1, 2)], np.int64)


@dataclass(frozen=True, eq=False)
class SceneBody:
    """A body in metres, z up: its plan area, from which height to which, and what it is called, nearest name first."""

    names: tuple[str, ...]
    shape: Polygon | MultiPolygon
    low_m: float
    high_m: float
    label: str = ""
    words: tuple[str, ...] = ()


def body_kind(names: Iterable[str]) -> str:
    """Wall, floor, door, opening, window, skipped or furniture."""
    return next((kind for name in names if (kind := _kind_in_name(name))), "furniture")


@lru_cache(maxsize=4096)  # the bodies of a scene share the names of what they are in
def _kind_in_name(name: str) -> str:
    """Return what one name says (R1), or "" if it says nothing."""
    plain = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name).lower()
    words = {word for word in re.split(r"[^a-z]+", plain) if word}
    for start, kind in _KINDS:
        if start in words or f"{start}s" in words:
            return "furniture" if start == "door" and names_furniture_with_doors(name) else kind
    return ""


def body_from_triangles(
    names: tuple[str, ...], points: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]
) -> SceneBody | None:
    """Return a body of triangles: ``points`` (n, 3) in metres, z up, ``faces`` (m, 3); None if it covers nothing."""
    shape = _covered_area(points[faces][:, :, :2])
    if shape is None:
        return None
    used = points[np.unique(faces), 2]
    return SceneBody(names, shape, float(used.min()), float(used.max()))


def _covered_area(triangles: npt.NDArray[np.float64]) -> Polygon | MultiPolygon | None:
    """Return what triangles (m, 3, 2) cover together, or None if that is nothing. Most bodies are boxes."""
    side, other = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    flat = triangles[np.abs(side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0]) > 2 * UPRIGHT_M2]
    if (found := _quadrilateral(flat)) is not None:
        return found
    parts = polygons_of(shapely.union_all(shapely.polygons(_without_twins(flat)), grid_size=FILE_GRID_M))
    return MultiPolygon(parts) if len(parts) > 1 else parts[0] if parts else None


def _quadrilateral(triangles: npt.NDArray[np.float64]) -> Polygon | None:
    """Return the convex quadrilateral that triangles (m, 3, 2) of its corners cover, or None if they do not cover one.

    Two triangles cover it that lack opposite corners.
    """
    places = round_to_grid(triangles, FILE_GRID_M)
    hull = shapely.convex_hull(shapely.multipoints(places.reshape(-1, 2)))
    corners = shapely.get_coordinates(hull)[:-1]
    if not isinstance(hull, Polygon) or len(corners) != 4:
        return None
    is_corner = (places[:, :, None] == corners).all(axis=3)
    lacks = (~is_corner.any(axis=1)).any(axis=0)
    return hull if is_corner.any(axis=2).all() and (lacks[:2] & lacks[2:]).any() else None


def _without_twins(triangles: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return triangles (m, 3, 2) without those that cover what an earlier one does, as a body's underside does."""
    corners = np.sort(triangles[..., 0] + 1j * triangles[..., 1], axis=1)
    _, first = np.unique(corners.view(np.float64), axis=0, return_index=True)
    return triangles[np.sort(first)]


def body_from_box(
    names: tuple[str, ...], at: npt.NDArray[np.float64], half: npt.NDArray[np.float64]
) -> SceneBody | None:
    """Return the body of a box as ``box_mesh`` places it: the hull of its corners; None if it covers nothing."""
    points = box_mesh(at, half)[0]
    if not np.isfinite(points).all():
        return None
    shape = shapely.convex_hull(shapely.multipoints(round_to_grid(points[:, :2], FILE_GRID_M)))
    if not shape.area > 2 * UPRIGHT_M2:
        return None
    return SceneBody(names, shape, float(points[:, 2].min()), float(points[:, 2].max()))


def bodies_from_sheets(
    names: tuple[str, ...], points: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]
) -> Iterator[SceneBody]:
    """Yield what upright faces show that cover nothing: walls as thick as a sheet, one for each two heights (R6)."""
    corners = points[faces]
    spans: dict[tuple[float, float], list[npt.NDArray[np.float64]]] = {}
    for triangle in corners:
        low, high = triangle[:, 2].min(), triangle[:, 2].max()
        spans.setdefault((round(float(low), 2), round(float(high), 2)), []).append(triangle[[0, 1, 2, 0], :2])
    for (low, high), rings in spans.items():
        if high > low:
            lines = shapely.union_all(shapely.linestrings(rings), grid_size=FILE_GRID_M)
            parts = polygons_of(shapely.buffer(lines, SHEET_M / 2, cap_style="square", join_style="mitre"))
            if parts:
                yield SceneBody(names, parts[0] if len(parts) == 1 else MultiPolygon(parts), low, high)


def body_from_many_triangles(
    names: tuple[str, ...], points: npt.NDArray[np.float64], faces: npt.NDArray[np.int64]
) -> SceneBody | None:
    """Return a body of many faces, as ``body_from_triangles`` does, but with an edge in steps of ``VOXEL_M``.

    Faces that are smaller than a cell fill the cells of their corners; the area of the others is united as it is.
    """
    a, b, c = (points[faces[:, k], :2] for k in range(3))
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    is_large = (high - low).max(axis=1) > VOXEL_M
    large = body_from_triangles(names, points, faces[is_large]) if is_large.any() else None
    small = np.concatenate([a[~is_large], b[~is_large], c[~is_large]])
    origin = np.floor(small.min(axis=0, initial=0.0) / VOXEL_M)
    columns, rows = (np.floor(small / VOXEL_M) - origin).astype(np.int64).T
    if len(small) and columns.max() * rows.max() > LARGEST_GRID:
        return body_from_triangles(names, points, faces)
    cells = np.zeros((columns.max(initial=0) + 1, rows.max(initial=0) + 1), np.bool_)
    cells[columns, rows] = True
    steps = np.diff(np.pad(cells, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    (column, start), (_, end) = np.nonzero(steps == 1), np.nonzero(steps == -1)
    x, y, top = (column + origin[0]) * VOXEL_M, (start + origin[1]) * VOXEL_M, (end + origin[1]) * VOXEL_M
    strips = shapely.box(x, y, x + VOXEL_M, top)
    whole = shapely.union_all([*strips, *([large.shape] if large is not None else [])], grid_size=FILE_GRID_M)
    parts = polygons_of(shapely.make_valid(whole))
    if not parts:
        return None
    heights = points[faces, 2]
    shape = parts[0] if len(parts) == 1 else MultiPolygon(parts)
    return SceneBody(names, shape, float(heights.min()), float(heights.max()))


def load_mesh_beside(
    folder: Path, name: str, left_out: LeftOutParts
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Return the points (n, 3) and faces (m, 3) of an .obj, .stl or .dae in a scene's folder; nothing else is opened.

    A .dae comes in metres and z up: COLLADA says its unit and its up axis. The others come as they are.
    What of it is left out is added to ``left_out``.

    Raises
    ------
    ValueError
        The file is not in the folder, of another format, too large, or damaged.
    """
    file = file_inside(folder, name)
    if file is None or format_suffix(file) not in _MESHES:
        raise ValueError(f"its mesh {name[:80]!r} is not in the folder, or no .obj, .stl or .dae")
    if file.stat().st_size > LARGEST_BYTES:
        raise ValueError(f"its mesh has {file.stat().st_size >> 20} MB")
    try:
        scene, said = load_scene(file), frame_convention(file)
    except Exception as error:  # noqa: BLE001 - the loader raises whatever broken bytes lead it to
        raise ValueError(f"its mesh cannot be read: {type(error).__name__}") from None
    if scene.left_out:
        left_out.add(f"{file.name}: {scene.left_out}")
    points, faces = scene.mesh.vertices, scene.mesh.faces
    if format_suffix(file) != ".dae":
        return points, faces
    points = points * (said.metres or 1.0)
    return (points[:, [0, 2, 1]] * (1.0, -1.0, 1.0) if said.up == "y" else points), faces


def storeys_from_bodies(bodies: Sequence[SceneBody]) -> list[DrawnStorey]:
    """Return the storeys of a scene, lowest first."""
    sorted_ = [(body_kind((each.label, *each.names) if each.label else each.names), each) for each in bodies]
    sorted_ = [("floor" if canonical(each.label) and kind == "furniture" else kind, each) for kind, each in sorted_]
    tops = [each.high_m for kind, each in sorted_ if kind == "floor"]
    feet = [each.low_m for kind, each in sorted_ if kind == "wall" and "lintel" not in each.names]
    heights = group_storey_heights(tops or feet)
    found = []
    for number, height in enumerate(heights):
        above = heights[number + 1] if number + 1 < len(heights) else np.inf
        here = [(kind, b) for kind, b in sorted_ if height - KNEE_M <= _foot(kind, b) < above - KNEE_M]
        found.append(storey_from_features(_features(here, height, above), height))
    return found


def _foot(kind: str, each: SceneBody) -> float:
    return each.high_m if kind == "floor" else each.low_m


def _features(here: Sequence[tuple[str, SceneBody]], height: float, above: float) -> list[Feature]:
    """Return the features of the bodies of a storey, whose floor is at ``height`` and its ceiling below ``above``."""
    walls, others = [], []
    for kind, each in here:
        low, top = each.low_m - height, each.high_m - height
        if kind == "wall" and top > KNEE_M:
            foot = low if low > KNEE_M else 0.0  # R2
            walls.append(Feature("wall", each.shape, low_m=foot, top_m=min(top, above - height), filled=True))
        elif kind in {"door", "opening"}:  # R4
            box = shapely.minimum_rotated_rectangle(each.shape)
            longest = np.hypot(*np.diff(shapely.get_coordinates(box)[:3], axis=0).T).max(initial=0.0)
            if NARROWEST_DOOR_M < longest < WIDEST_DOOR_BODY_M:
                # an opening is at least as deep as a hand, however thin its wall is
                others.append(Feature(kind, box, thick_m=HAND_M, low_m=low, top_m=top))
        elif kind == "window":
            others.append(Feature(kind, each.shape, low_m=low, top_m=top))
        elif kind == "floor":
            others.append(Feature("floor", each.shape))
        elif kind == "furniture":
            others.append(Feature("object", each.shape, (each.words or each.names)[:1], low_m=low, top_m=top))
    tops = [(each.top_m, each.shape.length) for each in walls if each.low_m == 0.0 and each.top_m is not None]
    over = KNEE_M + usual_height(tops)  # what ends higher is no furniture
    others = [each for each in others if each.kind != "object" or each.top_m is None or each.top_m < over]
    floors = [each for kind, each in here if kind == "floor"]
    standing = cache(lambda: shapely.buffer(shapely.union_all([each.shape for each in walls]), CRACK_M))  # seldom asked
    return [*walls, *others, *_join_open_pieces(_rooms(_without_pieces(floors, standing)), standing)]


def _rooms(floors: Sequence[SceneBody]) -> list[Feature]:
    """Pieces of one room, which differ in nothing but a number at their end, are one."""
    groups: dict[tuple[str, ...], list[SceneBody]] = {}
    for each in floors:
        name = each.names[0] if each.names else ""
        parts = [part for part in re.split(r"[|]", name) if part]
        key: tuple[str, ...]
        if len(parts) >= 2 and parts[0].lower() == "room":
            key = ("room", parts[1], parts[2] if len(parts) > 2 and labels_for((parts[2],)) else "")
            word = key[2]
        else:
            word = each.label
            key = (name, word)
        if re.match(r"(?i)threshold", name) or word.lower() in {"threshold"}:
            continue
        if not labels_for((word,)) and not re.match(r"(?i)(room|floor)[_|-]?\d+$", name) and key[0] != "room":
            continue
        groups.setdefault((*key, word), []).append(each)
    rooms = []
    for key, pieces in groups.items():
        whole = polygons_of(shapely.union_all([piece.shape for piece in pieces], grid_size=FILE_GRID_M))
        shape = max(whole, key=lambda part: part.area)
        said = key[-1]
        words = next((piece.words for piece in pieces if piece.words), (said,) if said and said != "Unlabelled" else ())
        rooms.append(Feature("room", shape, words, (said,)))
    return rooms


def _without_pieces(floors: Sequence[SceneBody], standing: Callable[[], BaseGeometry]) -> list[SceneBody]:
    """Drop floors that differ by a number and meet where no wall stands: pieces. ``standing`` gives the walls."""
    numbered = [i for i, each in enumerate(floors) if _is_numbered(each)]
    if len(numbered) < 2:
        return list(floors)
    shapes = [floors[i].shape for i in numbered]
    pairs = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=FILE_GRID_M).T
    for one, other in pairs[pairs[:, 0] < pairs[:, 1]].tolist():
        edge = shapely.intersection(shapely.buffer(shapes[one], FILE_GRID_M), shapely.boundary(shapes[other]))
        if edge.length > NARROWEST_DOOR_M and shapely.difference(edge, standing()).length > edge.length / 2:
            return [each for i, each in enumerate(floors) if i not in set(numbered)]
    return list(floors)


def _is_numbered(each: SceneBody) -> bool:
    """Return whether a floor has no name but floor and a number."""
    name = each.names[0] if each.names else ""
    return re.match(r"(?i)floor[_|-]?\d+$", name) is not None and not labels_for((each.label,))


def _join_open_pieces(rooms: Sequence[Feature], standing: Callable[[], BaseGeometry]) -> list[Feature]:
    """Join floors of one name that meet where no wall stands; ``standing`` gives the walls."""
    kept: list[Feature] = []
    for room in rooms:
        whole = room
        for other in list(kept):
            if room.words and other.words == room.words:
                shape = _across_open_edge(whole.shape, other.shape, standing)
                if shape is not None:
                    kept = [each for each in kept if each is not other]
                    whole = replace(room, shape=shape)
        kept.append(whole)
    return kept


def _across_open_edge(one: Polygon, other: Polygon, standing: Callable[[], BaseGeometry]) -> Polygon | None:
    """Return two rooms as one where they meet along more than a door's width and no wall stands at most of it."""
    edge = shapely.intersection(buffer_mitred(one, CRACK_M), other.exterior)
    if edge.length < NARROWEST_DOOR_M or shapely.difference(edge, standing()).length < edge.length / 2:
        return None
    whole = buffer_mitred(buffer_mitred(shapely.union(one, other), CRACK_M), -CRACK_M)
    return whole if isinstance(whole, Polygon) else None


def box_mesh(
    at: npt.NDArray[np.float64], half: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Return a box's points (8, 3) and faces (12, 3): ``at`` (4, 4) places it, ``half`` are its half sizes."""
    return _CORNERS * half @ at[:3, :3].T + at[:3, 3], _FACES_OF_BOX.copy()
