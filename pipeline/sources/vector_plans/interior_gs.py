"""Read an InteriorGS floor plan (``structure.json``): rooms, walls as thick lines, doors in them, boxes of furniture.

Format: manycore-research/InteriorGS, README, "Floorplan data": metres, z up. ``rooms`` have a ``profile``, a polygon of
the plan, and a ``room_type``; ``walls`` a ``location``, a line of the plan, with ``thickness`` and ``height``;
``holes`` a ``profile``, an upright polygon in space, with ``thickness`` and a ``type``, WINDOW or DOOR; ``ins`` a
``label``, and the ``position`` and ``size`` of a box along the axes.

R1  A hole of type DOOR is a door through the wall, as wide as its profile. A window is not a door.
R2  A room is a "virtual partition", as the README says: it names the space in it, and walls bound it.
R3  An instance is furniture, unless it fills a hole, hangs above a person, or covers more than LARGEST_THING_M2.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from shapely import LineString

from pipeline.sources.files import LeftOutParts, read_json_object
from pipeline.sources.tolerances import LARGEST_THING_M2, LONGEST_SITE_M, LOWEST_HEAD_M
from pipeline.sources.vector_plans.drawing import Drawing, Feature, area_from_ring, points_from, wall_thickness
from pipeline.sources.vector_plans.named_features import storey_from_features

_FILLINGS: Final = ("door", "window", "curtain", "blind")


def can_read(path: Path, head: bytes) -> bool:
    """By its name and some of its keys, or by more of them."""
    if path.suffix.lower() != ".json":
        return False
    keys = [key for key in (b'"rooms"', b'"walls"', b'"holes"', b'"ins"') if key in head]
    drawn = b'"profile"' in head or (b'"location"' in head and b'"thickness"' in head)
    least = 1 if path.name.lower() == "structure.json" else 3
    return drawn and len(keys) >= least


def read_drawing(path: Path) -> Drawing:
    """Read a floor plan; raise Rejection if it cannot be read."""
    found = read_json_object(path, "copy it again from the data set")
    left_out = LeftOutParts()
    makers = {"walls": _wall, "rooms": _room, "holes": _hole, "ins": _thing}
    features = [each for key, make in makers.items() for each in left_out.each(found.get(key), key, make)]
    return Drawing("interiorgs", (storey_from_features(features),), left_out, wanted="walls with a location")


def _wall(said: Any) -> Feature:
    line = LineString(points_from(said["location"])[[0, -1], :2])
    thick, height = float(said["thickness"]), float(said["height"])
    if not (line.length > 0 and 0 < height < LONGEST_SITE_M):
        raise ValueError(f"a wall {line.length:g} m long and {height:g} m high")
    return Feature("wall", line, thick_m=wall_thickness(thick), top_m=height)


def _room(said: Any) -> Feature:
    """R2."""
    word = said.get("room_type")
    shape = area_from_ring(points_from(said["profile"], 3)[:, :2])
    return Feature("room", shape, (word,) if isinstance(word, str) and word else ())


def _hole(said: Any) -> Feature | None:
    """R1."""
    profile = points_from(said["profile"], 3)
    if str(said["type"]).upper() != "DOOR":
        return None
    flat, heights = profile[:, :2], profile[:, 2]
    far = np.hypot(*(flat[:, None] - flat[None]).transpose(2, 0, 1))
    ends = LineString(flat[list(np.unravel_index(int(far.argmax()), far.shape))])
    thick = wall_thickness(float(said["thickness"]))
    return Feature("door", ends, thick_m=thick, low_m=float(heights.min()), top_m=float(heights.max()))


def _thing(said: Any) -> Feature | None:
    """R3."""
    word = str(said["label"])
    at, size = points_from([said["position"], said["size"]])
    if (size <= 0).any():
        raise ValueError("a box without a size")
    (x1, y1, low), (x2, y2, high) = (at - size / 2).tolist(), (at + size / 2).tolist()
    hangs = low >= LOWEST_HEAD_M or (x2 - x1) * (y2 - y1) > LARGEST_THING_M2
    if hangs or any(filling in word.lower() for filling in _FILLINGS):
        return None
    return Feature("object", shapely.box(x1, y1, x2, y2), (word,), low_m=low, top_m=high)
