"""Read walls, holes and floors as the scene toolkit of smartscenes writes them: HSSD, SceneEval, libsg.

HSSD's files are called ``*.scenestate.json``.

Format: ``{"format": "sceneState", "scene": {"arch": {...}}}``, or the ``arch`` alone. Its ``elements`` are walls
(``points``: the two ends, ``height``, ``depth``, ``holes`` with a ``type`` and a ``box`` along the wall and up), floors
(``points``: a polygon, ``roomId``) and ceilings; ``regions`` may name the rooms. ``up`` and ``scaleToMeters`` hold.

R1  A hole called door or opening is a passage; only a door has a leaf. Windows are not passages.
R2  A floor is a room of its ``roomId``; its name is the region's ``type`` or ``label``.
R3  Floors more than STOREYS_APART_M apart are storeys; a wall belongs to the storey whose floor is nearest its foot.
    Objects are not read: their models lie elsewhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from shapely import LineString

from pipeline.rejection import Reason, Rejection
from pipeline.sources.drawn_storeys import group_storey_heights
from pipeline.sources.files import PART_FAULTS, LeftOutParts, read_json_object
from pipeline.sources.tolerances import LINE_WALL_M, LONGEST_SITE_M, TINY, WALL_HEIGHT_M
from pipeline.sources.vector_plans.drawing import Drawing, Feature, Floats, area_from_ring, points_from, wall_thickness
from pipeline.sources.vector_plans.named_features import storey_from_features

_ADVICE = "copy it again from the data set"


def can_read(path: Path, head: bytes) -> bool:
    """By the format's name, or the version of its architecture."""
    return path.suffix.lower() == ".json" and (b'"sceneState"' in head or b'"arch@' in head)


def read_drawing(path: Path) -> Drawing:
    """Read a scene; raise Rejection if it cannot be read."""
    document = read_json_object(path, _ADVICE)
    try:
        scene = document.get("scene", document)
        arch = scene.get("arch", scene)
        elements, up = list(arch["elements"]), [float(each) for each in arch.get("up", (0, 0, 1))]
        scale = float(arch.get("scaleToMeters", 1.0))
    except PART_FAULTS as error:
        detail = f"{path.name}: expected scene.arch.elements, found {type(error).__name__}: {str(error)[:80]}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE) from None
    if not 0 < scale < LONGEST_SITE_M or len(up) != 3:
        raise Rejection("source", Reason.BAD_UNITS, f"{path.name}: a metre is {scale} of its lengths", _ADVICE)
    reader = _Elements(arch, scale, abs(up[1]) > abs(up[2]))
    left_out = LeftOutParts()
    found = [each for made in left_out.each(elements, "element", reader.features) for each in made]
    feet = [foot for foot, each in found if each.kind == "room"] or [
        foot for foot, each in found if each.kind == "wall"
    ]
    heights = np.array(group_storey_heights(feet))
    storeys = [
        storey_from_features([each for foot, each in found if np.argmin(np.abs(heights - foot)) == number], height)
        for number, height in enumerate(heights.tolist())
    ]  # R3
    wanted = f"walls and floors among {len(elements)} elements"
    return Drawing("scene_state", tuple(storeys), left_out, y_up=reader.y_up, wanted=wanted)


class _Elements:
    """Reads the elements of an architecture: ``scale`` metres are one of its lengths."""

    def __init__(self, arch: Mapping[str, Any], scale: float, y_up: bool) -> None:
        self.scale, self.y_up = scale, y_up
        self.names = dict(_names(arch))
        defaults = arch.get("defaults")
        walls = defaults.get("Wall") if isinstance(defaults, Mapping) else None
        self.defaults: Mapping[str, Any] = walls if isinstance(walls, Mapping) else {}

    def features(self, element: Any) -> list[tuple[float, Feature]] | None:
        """Return the features of an element, each with the height of the floor below it; None for other elements."""
        kind, points = str(element["type"]).lower(), points_from(element["points"], columns=3, unit_m=self.scale)
        points = points[:, [0, 2, 1]] * (1.0, -1.0, 1.0) if self.y_up else points
        if kind in {"wall", "railing"}:
            foot = float(points[[0, -1], 2].min())
            return [(foot, each) for each in self._wall(element, points[0, :2], points[-1, :2])]
        if kind != "floor":
            return None
        word = self.names.get(str(element.get("roomId", "")), "")
        room = Feature("room", area_from_ring(points[:, :2]), (word,) if word else ())
        return [(float(np.median(points[:, 2])), room)]

    def _wall(self, element: Mapping[str, Any], a: Floats, b: Floats) -> Iterator[Feature]:
        sizes = (("height", WALL_HEIGHT_M), ("depth", LINE_WALL_M))
        height, depth = (
            float(element.get(key, self.defaults.get(key, usual / self.scale))) * self.scale for key, usual in sizes
        )
        if not (0 < height < LONGEST_SITE_M and math.isfinite(depth)):
            raise ValueError(f"a wall {height:g} m high")
        yield Feature("wall", LineString([a, b]), thick_m=wall_thickness(depth), top_m=height)
        holes, along = element.get("holes"), (b - a) / max(math.dist(a, b), TINY)
        for said in holes if isinstance(holes, list) else ():
            try:
                kind = str(said.get("type", "")).lower()
                box = np.array([said["box"][key][:2] for key in ("min", "max")], np.float64) * self.scale
                (start, low), (end, top) = box.tolist()
            except PART_FAULTS:
                continue
            if kind not in {"door", "opening", "window"} or not (np.isfinite(box).all() and end > start):  # R1
                continue
            ends, thick = LineString([a + along * start, a + along * end]), wall_thickness(depth)
            if kind == "window":
                yield Feature(kind, ends.buffer(thick / 2, cap_style="flat"), low_m=low, top_m=top)
            else:
                yield Feature(kind, ends, thick_m=thick, low_m=low, top_m=top)


def _names(arch: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield what the regions call the rooms."""
    for key in ("regions", "rooms"):
        regions = arch.get(key)
        for each in regions if isinstance(regions, list) else ():
            if isinstance(each, Mapping):
                said = next((each[k] for k in ("type", "label", "name", "types") if each.get(k)), "")
                word = said[0] if isinstance(said, list) and said else said
                if isinstance(word, str) and word:
                    yield str(each.get("id", "")), word
