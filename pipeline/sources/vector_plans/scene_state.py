"""Read walls, holes and floors as the scene toolkit of smartscenes writes them: HSSD, SceneEval, libsg.

HSSD's files are called ``*.scenestate.json``.

Format: ``{"format": "sceneState", "scene": {"arch": {...}}}``, or the ``arch`` alone. Its ``elements`` are walls
(``points``: the two ends, ``height``, ``depth``, ``holes`` with a ``type`` and a ``box`` along the wall and up), floors
(``points``: a polygon, ``roomId``) and ceilings; ``regions`` may name the rooms. ``up`` and ``scaleToMeters`` hold.

R1  A wall stands on its line, half of its depth to each side; each of two rooms may bring its own.
R2  A hole called door or opening is a passage; only a door has a leaf. Windows are none.
R3  A floor is a room of its ``roomId``; its name is the region's ``type`` or ``label``.
R4  Floors more than STOREYS_APART_M apart are storeys; a wall belongs to the storey whose floor is nearest its foot.
R5  What cannot be read is left out, with a note. Objects are not read: their models lie elsewhere.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from shapely import Polygon

from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import (
    Hole,
    Wall,
    group_storey_heights,
    merge_parallel_holes,
    polygon_from_ring,
    unite_rooms,
)
from pipeline.sources.files import LARGEST_BYTES, LeftOutParts
from pipeline.sources.tolerances import LINE_WALL_M, LONGEST_SITE_M, THICKEST_LINE_M, TINY, WALL_HEIGHT_M
from pipeline.sources.vector_plans.drawing import (
    Drawing,
    DrawnStorey,
    Point,
    door_hole,
    named_room,
    wall_along_line,
    walls_between_faces,
)
from pipeline.values import SourceRoom

_ADVICE: Final = "copy it again from the data set"
_FAULTS: Final = (KeyError, TypeError, ValueError, IndexError, OverflowError, AttributeError)


@dataclass(frozen=True, eq=False)
class _Line:
    """A wall: its ends in the plan, the height of its foot, how high and thick it is, and its holes."""

    a: Point
    b: Point
    foot_m: float
    height_m: float
    depth_m: float
    holes: Sequence[Any]


def can_read(path: Path, head: bytes) -> bool:
    """By the format's name, or the version of its architecture."""
    return path.suffix.lower() == ".json" and (b'"sceneState"' in head or b'"arch@' in head)


def read_drawing(path: Path) -> Drawing:
    """Read a scene; raise Rejection if it cannot be read or has no wall and no floor."""
    if path.stat().st_size > LARGEST_BYTES:
        raise Rejection("source", Reason.TOO_LARGE, f"{path.name} has {path.stat().st_size >> 20} MB", _ADVICE)
    try:
        document = json.loads(path.read_bytes())
        scene = document.get("scene", document)
        arch = scene.get("arch", scene)
        elements, up = list(arch["elements"]), [float(each) for each in arch.get("up", (0, 0, 1))]
        scale = float(arch.get("scaleToMeters", 1.0))
    except (*_FAULTS, RecursionError) as error:
        detail = f"{path.name}: expected scene.arch.elements, found {type(error).__name__}: {str(error)[:80]}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None
    if not 0 < scale < LONGEST_SITE_M or len(up) != 3:
        raise Rejection("source", Reason.BAD_UNITS, f"{path.name}: a metre is {scale} of its lengths", _ADVICE)
    y_up, left_out = abs(up[1]) > abs(up[2]), LeftOutParts()
    names = dict(_names(arch))
    walls, rooms = [], []
    for number, element in enumerate(elements):
        try:
            points = _points(element["points"], scale, y_up)
            kind = str(element["type"]).lower()
            if kind in {"wall", "railing"}:
                walls.append(_wall(element, points, arch, scale))
            elif kind == "floor":
                shape = polygon_from_ring(points[:, :2])
                if shape is None:
                    raise ValueError("a floor without an area")
                word = names.get(str(element.get("roomId", "")), "")
                rooms.append((float(np.median(points[:, 2])), named_room(word, shape)))
        except _FAULTS as error:
            left_out.add(f"element {number}: {type(error).__name__}: {str(error)[:60]}")
    if not walls and not rooms:
        detail = f"{path.name}: expected walls and floors, found {len(elements)} elements of other types"
        raise Rejection("source", Reason.NO_LEVEL, detail, "leave the file out")
    storeys = tuple(_storeys(walls, rooms, scale))
    return Drawing("scene_state", storeys, left_out, y_up=y_up)


def _names(arch: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """R3: yield what the regions call the rooms."""
    for key in ("regions", "rooms"):
        regions = arch.get(key)
        for each in regions if isinstance(regions, list) else ():
            if not isinstance(each, Mapping):
                continue
            said = next((each[k] for k in ("type", "label", "name", "types") if each.get(k)), "")
            word = said[0] if isinstance(said, list) and said else said
            if isinstance(word, str) and word:
                yield str(each.get("id", "")), word


def _points(points: Any, scale: float, y_up: bool) -> np.ndarray:
    """Points (n, 3) in metres, z up."""
    found = np.array(points, np.float64) * scale
    if found.ndim != 2 or found.shape[1] != 3 or len(found) < 2 or not np.isfinite(found).all():
        raise ValueError("expected points of three numbers")
    if np.abs(found).max() > 10 * LONGEST_SITE_M:
        raise ValueError("it lies beyond any building")
    return found[:, [0, 2, 1]] * (1.0, -1.0, 1.0) if y_up else found


def _wall(element: Mapping[str, Any], points: np.ndarray, arch: Mapping[str, Any], scale: float) -> _Line:
    """R1."""
    defaults = arch.get("defaults", {}).get("Wall", {})
    height = float(element.get("height", defaults.get("height", WALL_HEIGHT_M / scale))) * scale
    depth = float(element.get("depth", defaults.get("depth", LINE_WALL_M / scale))) * scale
    if not (0 < height < LONGEST_SITE_M and math.isfinite(depth)):
        raise ValueError(f"a wall {height:g} m high")
    holes = element.get("holes") or ()
    (ax, ay, az), (bx, by, bz) = points[0].tolist(), points[-1].tolist()
    thick = depth if 0 < depth < THICKEST_LINE_M else LINE_WALL_M
    return _Line((ax, ay), (bx, by), min(az, bz), height, thick, holes if isinstance(holes, list) else ())


def _storeys(walls: Sequence[_Line], rooms: Sequence[tuple[float, SourceRoom]], scale: float) -> Iterator[DrawnStorey]:
    """R4."""
    heights = np.array(group_storey_heights([height for height, _ in rooms] or [wall.foot_m for wall in walls]))
    for number, height in enumerate(heights.tolist()):
        here = [wall for wall in walls if int(np.argmin(np.abs(heights - wall.foot_m))) == number]
        named = tuple(each for foot, each in rooms if int(np.argmin(np.abs(heights - foot))) == number)
        yield _storey(here, named, height, scale)


def _storey(lines: Sequence[_Line], rooms: tuple[SourceRoom, ...], height: float, scale: float) -> DrawnStorey:
    shapes = [shape for line in lines if (shape := _longer(line)) is not None]
    top = float(np.median([line.height_m for line in lines])) if lines else WALL_HEIGHT_M
    body = walls_between_faces(shapes) if shapes else []
    holes = [hole for line in lines for each in line.holes if (hole := _hole(line, each, body, scale)) is not None]
    return DrawnStorey(
        walls=tuple(Wall(part, 0.0, top) for part in body),
        holes=tuple(merge_parallel_holes(holes)),
        rooms=rooms,
        floor=unite_rooms([each.polygon for each in rooms if each.polygon is not None]),
        height_m=height,
        all_named=bool(holes),
    )


def _longer(line: _Line) -> Polygon | None:
    """A wall's strip; it goes on by half of its thickness, so that corners close."""
    length = math.dist(line.a, line.b)
    if length <= 0:
        return None
    more = np.subtract(line.b, line.a) / length * line.depth_m / 2
    return wall_along_line((np.asarray(line.a) - more).tolist(), (np.asarray(line.b) + more).tolist(), line.depth_m)


def _hole(line: _Line, said: Any, walls: Sequence[Polygon], scale: float) -> Hole | None:
    """R2."""
    try:
        kind = str(said.get("type", "")).lower()
        (start, low), (end, high) = (np.array(said["box"][key][:2], np.float64) * scale for key in ("min", "max"))
    except _FAULTS:
        return None
    if kind not in {"door", "opening"} or not np.isfinite([start, low, end, high]).all() or end <= start:
        return None
    along = np.subtract(line.b, line.a) / max(math.dist(line.a, line.b), TINY)
    a, b = (np.asarray(line.a) + along * at for at in (start, end))
    return door_hole(
        a.tolist(), b.tolist(), walls, has_door=kind == "door", bottom_m=float(low), top_m=float(high),
        thick_m=line.depth_m,
    )  # fmt: skip
