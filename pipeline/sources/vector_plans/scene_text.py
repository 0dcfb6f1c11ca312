"""Read a layout written as text, one wall, door or box of furniture a line: SpatialLM, Aria Synthetic Environments.

A wall is ``wall_0=Wall(...)`` in SpatialLM, and ``make_wall, id=0, ...`` in Aria Synthetic Environments.

Formats: manycore-research/SpatialLM (Wall: ax, ay, az, bx, by, bz, height, thickness; Door and Window: wall, x, y, z,
width, height; Bbox: class, x, y, z, angle_z, sx, sy, sz) and facebookresearch/scenescript (make_wall: a_x .. b_z,
height, thickness; make_door, make_window: wall0_id, position_x .. z, width, height; make_bbox). Metres, z up.

R1  A wall without a thickness is LINE_WALL_M thick about its line.
R2  A door stands in its wall, its middle at its position. A window is not a way.
R3  What names a wall that is not there, or has a number that cannot be read, is left out, with a note.
R4  No room has a name: rooms are what the walls enclose.
R5  Whole numbers are the bins of SpatialLM's answer before it is read: 1,280 of 32 m for places, of 25.6 m for widths
    and heights, of 20 m for the sides of boxes, of two turns for their angles.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import shapely
from shapely import LineString
from shapely.affinity import rotate, translate

from pipeline.sources.files import LeftOutParts, read_bytes
from pipeline.sources.tolerances import LARGEST_TEXT_BYTES, LONGEST_SITE_M, TINY
from pipeline.sources.vector_plans.drawing import Drawing, Feature, wall_thickness
from pipeline.sources.vector_plans.named_features import storey_from_features

BINS, PLACES_M = 1280, 32.0
_SPANS_M: Final = {"width": 25.6, "height": 25.6, "thickness": 25.6, "scale": 20.0}
FEWEST_BINS = 50
"""A wall of so many bins is a metre high; no wall is as many metres high."""
_SPATIAL: Final = re.compile(r"^\s*(\w+)\s*=\s*(Wall|Door|Window|Bbox)\(([^()]*)\)\s*$")
_ARIA: Final = re.compile(r"^\s*make_(wall|door|window|bbox)\s*,(.*)$")
_FIELDS: Final = {
    "wall": ("a_x", "a_y", "a_z", "b_x", "b_y", "b_z", "height", "thickness"),
    "door": ("wall0_id", "position_x", "position_y", "position_z", "width", "height"),
    "bbox": ("class", "position_x", "position_y", "position_z", "angle_z", "scale_x", "scale_y", "scale_z"),
}


def can_read(path: Path, head: bytes) -> bool:
    """By a line of either language."""
    return path.suffix.lower() in {".txt", ".csv"} and (
        re.search(rb"(?m)^\s*make_wall\s*,", head) is not None
        or re.search(rb"(?m)^\s*\w+\s*=\s*Wall\(", head) is not None
    )


def read_drawing(path: Path) -> Drawing:
    """Read a layout; raise Rejection if it is too large."""
    text = read_bytes(path, "expected a layout", LARGEST_TEXT_BYTES).decode("utf-8-sig", "replace")
    left_out = LeftOutParts()
    things = _from_bins(list(_things(text, left_out)))
    walls, by_name, feet = list[Feature](), dict[str, Feature](), list[float]()
    for name, _, said in (each for each in things if each[1] == "wall"):
        ax, ay, az, bx, by, bz, height = found = [_number(said, field) for field in _FIELDS["wall"][:7]]
        if not all(map(math.isfinite, found)) or max(map(abs, found)) > LONGEST_SITE_M:
            left_out.add(f"wall {name[:40]} has a number that cannot be read")
            continue
        thick = round(wall_thickness(_number(said, "thickness")), 3)  # R1
        by_name[name] = Feature("wall", LineString([(ax, ay), (bx, by)]), thick_m=thick, top_m=height)
        walls.append(by_name[name])
        feet.append(min(az, bz))
    foot = float(np.median(feet)) if feet else 0.0
    doors = (_door(name, said, by_name, foot, left_out) for name, kind, said in things if kind == "door")
    boxes = (_thing(name, said, foot) for name, kind, said in things if kind == "bbox")
    features = [*walls, *filter(None, doors), *filter(None, boxes)]
    return Drawing("layout text", (storey_from_features(features, foot),), left_out, wanted="walls")


def _things(text: str, left_out: LeftOutParts) -> Iterator[tuple[str, str, dict[str, str]]]:
    """Yield (name, kind, fields) of each line."""
    for number, line in enumerate(text.splitlines()):
        spatial, aria = _SPATIAL.match(line), _ARIA.match(line)
        if spatial:
            kind = spatial[2].lower()
            values = [each.strip() for each in spatial[3].split(",")]
            yield spatial[1], kind, dict(zip(_FIELDS.get(kind, _FIELDS["door"]), values, strict=False))
        elif aria:
            pairs = [each.split("=", 1) for each in aria[2].split(",") if "=" in each]
            said = {key.strip(): value.strip() for key, value in pairs}
            yield said.get("id", str(number)), aria[1], said
        elif line.strip():
            left_out.add(f"line {number + 1} is no wall, door, window or bbox: {line.strip()[:40]!r}")


def _from_bins(things: list[tuple[str, str, dict[str, str]]]) -> list[tuple[str, str, dict[str, str]]]:
    """R5: return things in metres; as they are, if their walls are not as high as walls in bins are."""
    heights = [said.get("height", "") for _, kind, said in things if kind == "wall"]
    if not heights or not all(re.fullmatch(r"\d{1,5}", each) and int(each) >= FEWEST_BINS for each in heights):
        return things
    return [
        (name, kind, {key: _in_metres(key, value) for key, value in said.items()} if kind in _FIELDS else said)
        for name, kind, said in things
    ]


def _in_metres(field: str, value: str) -> str:
    """Return a number of bins in metres or radians, and all else as it is."""
    if not re.fullmatch(r"\d{1,5}", value) or field in {"wall0_id", "class", "id"}:
        return value
    if field == "angle_z":
        return str((int(value) / BINS * 2 - 1) * 2 * math.pi)
    size = next((size for ends, size in _SPANS_M.items() if field.startswith(ends)), PLACES_M)
    return str(int(value) * size / BINS)


def _door(
    name: str, said: dict[str, str], walls: dict[str, Feature], foot: float, left_out: LeftOutParts
) -> Feature | None:
    """R2."""
    wall = walls.get(said.get("wall0_id", ""))
    at = np.array([_number(said, "position_x"), _number(said, "position_y")])
    width, height, middle = (_number(said, field) for field in ("width", "height", "position_z"))
    if wall is None or not np.isfinite([*at, width, height, middle]).all():
        left_out.add(f"door {name[:40]} names no wall that is there, or has a number that cannot be read")
        return None
    a, b = shapely.get_coordinates(wall.shape)
    along = (b - a) / max(float(np.hypot(*(b - a))), TINY)
    on = a + along * float((at - a) @ along)
    ends = LineString([on - along * width / 2, on + along * width / 2])
    return Feature("door", ends, low_m=max(0.0, middle - height / 2 - foot), top_m=middle + height / 2 - foot)


def _thing(name: str, said: dict[str, str], foot: float) -> Feature | None:
    x, y, z, turn, *size = (_number(said, field) for field in _FIELDS["bbox"][1:])
    if not np.isfinite([x, y, z, turn, *size]).all() or min(size) <= 0:
        return None
    box = shapely.box(-size[0] / 2, -size[1] / 2, size[0] / 2, size[1] / 2)
    shape = translate(rotate(box, turn, origin=(0, 0), use_radians=True), x, y)
    middle = z - foot
    return Feature("object", shape, (said.get("class", name),), low_m=middle - size[2] / 2, top_m=middle + size[2] / 2)


def _number(said: dict[str, str], field: str) -> float:
    try:
        return float(said.get(field, "nan"))
    except ValueError:
        return math.nan
