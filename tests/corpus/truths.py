"""Truth that a person has drawn: which rooms and doors the storeys of a file have, whatever the program makes of it.

``truths/NAME.json`` belongs to the file of that name in the list. It holds strokes, seeds and labels only, nothing of
the file's own geometry::

    {"storeys": [{"level": 0, "extent": [8.2, 6.1], "heights": [0.6, 1.2, 1.9],
                  "ignore": [[x0, y0, x1, y1]], "walls": [[x0, y0, x1, y1]],
                  "doors": [{"a": [x, y], "b": [x, y], "interior": true}], "open": [[x0, y0, x1, y1]],
                  "rooms": [{"seed": [x, y], "label": "Kitchen"}]}]}

All lengths are metres in the source's plan axes (those of a plan's ``frame``).

Rules:

1. The walls are what the reader's level shows at ``heights`` above its floor, but for what lies in a box of ``ignore``,
   and the strokes of ``walls`` (windows, glass, low walls). Doors and what is ``open`` close, too.
2. A room is all that can be reached from its seed, with what stands free in it, but for other rooms. One that reaches
   the border, or another's seed, is a fault of the drawing.
3. Where the level's walls are not as large as ``extent``, within 2%, the reader has changed its mind on scale or
   storey: nothing of the storey is found.
4. A room is found where one of the plan's overlaps it with an IoU of 0.6 or more, one to one. An interior door is found
   where a door or opening of the plan has its middle within 0.35 m. Cuts find no door.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import msgspec
import numpy as np
import numpy.typing as npt
import shapely
import trimesh
from scipy.optimize import linear_sum_assignment
from shapely import Polygon

from houseexpo.dataset.storey_labels import NEAR_WAY_M
from houseexpo.errors import ConfigError
from houseexpo.grids.frame import source_points_from_plan
from pipeline.fitting.labels import SAME_EXTENT
from pipeline.source_record import extent_of
from pipeline.sources import find, reader
from pipeline.values import Level, Mesh
from tests.builders.matching import found_near

TRUTHS: Final = Path(__file__).parent / "truths"
HEIGHTS_M: Final = (0.6, 1.2, 1.9)
FOUND_IOU: Final = 0.6
MARGIN_M: Final = 0.5
CELL_M: Final = 0.02
JAMB_M: Final = 0.05
MOST_CELLS: Final = 16_000_000

Stroke = tuple[float, float, float, float]
Floats = npt.NDArray[np.float64]


class Door(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A door from jamb to jamb; ``interior`` is False where it leads outside."""

    a: tuple[float, float]
    b: tuple[float, float]
    interior: bool = True

    @property
    def middle(self) -> Floats:
        """Halfway between the jambs."""
        return (np.asarray(self.a) + np.asarray(self.b)) / 2


class Room(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A room by a point in it."""

    seed: tuple[float, float]
    label: str = ""


class Storey(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """What a person has drawn of one storey."""

    level: int
    extent: tuple[float, float]
    rooms: list[Room]
    doors: list[Door] = []
    walls: list[Stroke] = []
    open: list[Stroke] = []
    ignore: list[Stroke] = []
    heights: list[float] = msgspec.field(default_factory=lambda: list(HEIGHTS_M))


class Truth(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The storeys of a file."""

    storeys: list[Storey]


@dataclass(frozen=True)
class Found:
    """What plans have of some storeys: how many of the rooms and interior doors, and the rooms' mean IoU."""

    rooms: int = 0
    rooms_found: int = 0
    rooms_made: int = 0
    doors: int = 0
    doors_found: int = 0
    doors_made: int = 0
    iou_sum: float = 0.0

    def __add__(self, other: Found) -> Found:
        """Count both."""
        return Found(*(getattr(self, name) + getattr(other, name) for name in self.__dataclass_fields__))

    @property
    def is_whole(self) -> bool:
        """Whether every room and every door is found, and none made up."""
        return (self.rooms, self.doors) == (self.rooms_found, self.doors_found) == (self.rooms_made, self.doors_made)

    @property
    def row(self) -> list[str]:
        """The figures as cells of a table."""
        return [
            f"{self.rooms_found} of {self.rooms}",
            str(self.rooms_made),
            f"{self.iou_sum / self.rooms:.2f}" if self.rooms else "",
            f"{self.doors_found} of {self.doors}",
            str(self.doors_made),
        ]


COLUMNS: Final = ("rooms found", "rooms in plans", "mean IoU", "doors found", "doors in plans")


def load(name: str, folder: Path = TRUTHS) -> Truth | None:
    """Return the truth of a file of the list, None where nobody has drawn one; raise ConfigError if it is damaged."""
    path = folder / f"{name}.json"
    if not path.is_file():
        return None
    try:
        return msgspec.json.decode(path.read_bytes(), type=Truth)
    except msgspec.DecodeError as error:
        raise ConfigError(f"{path}: {error}") from None


def save(name: str, truth: Truth, folder: Path = TRUTHS) -> None:
    """Write a truth, one line for each stroke, door and room."""
    folder.mkdir(exist_ok=True)
    storeys = []
    for storey in truth.storeys:
        fields = []
        for key, value in msgspec.to_builtins(storey).items():
            lines = [msgspec.json.encode(item).decode() for item in value] if isinstance(value, list | tuple) else []
            long = lines and key not in {"extent", "heights"}
            body = "[\n   " + ",\n   ".join(lines) + "]" if long else msgspec.json.encode(value).decode()
            fields.append(f'  "{key}": {body}')
        storeys.append("{\n" + ",\n".join(fields) + "}")
    (folder / f"{name}.json").write_text('{"storeys": [\n ' + ",\n ".join(storeys) + "]}\n", encoding="utf-8")


def levels_of(path: str, models: str) -> list[Level]:
    """All levels of a file that can be read, as far as they can; ``models`` are folders of models, as in a build."""
    found: list[Level] = []
    with contextlib.suppress(Exception):  # the build says what is wrong
        for item in find(path, model_path=models):
            found += [level for level in reader(item.reader).read(item) if isinstance(level, Level)]
    return found


def section(mesh: Mesh, height: float) -> Floats:
    """Where a mesh meets a height, (n, 2, 2)."""
    if not len(mesh.faces):
        return np.empty((0, 2, 2))
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    found = trimesh.intersections.mesh_plane(whole, plane_normal=[0, 0, 1], plane_origin=[0, 0, height + 0.0013])
    return np.asarray(found, np.float64).reshape(-1, 2, 3)[:, :, :2]


def walls_of(level: Level, storey: Storey) -> Floats:
    """R1: the sections (n, 2, 2) of a level's walls, in the source's plan axes."""
    cuts = np.concatenate([section(level.walls, height) for height in storey.heights])
    cuts = source_points_from_plan(level.frame, cuts.reshape(-1, 2)).reshape(-1, 2, 2)
    middle = cuts.mean(axis=1)
    for x0, y0, x1, y1 in storey.ignore:
        inside = ((middle >= np.minimum((x0, y0), (x1, y1))) & (middle <= np.maximum((x0, y0), (x1, y1)))).all(axis=1)
        cuts, middle = cuts[~inside], middle[~inside]
    return cuts


def rooms_of(level: Level, storey: Storey) -> list[Polygon]:
    """R2: the rooms as areas in the source's plan axes, in the order of their seeds; raise ConfigError at a fault."""
    strokes = [walls_of(level, storey), *([s] for s in _strokes(storey))]
    lines = np.concatenate([np.asarray(each, np.float64).reshape(-1, 2, 2) for each in strokes])
    seeds = np.array([room.seed for room in storey.rooms])
    ends = np.concatenate([lines.reshape(-1, 2), seeds])
    low, high = ends.min(axis=0) - MARGIN_M, ends.max(axis=0) + MARGIN_M
    cell = max(CELL_M, float(np.sqrt(np.prod(high - low) / MOST_CELLS)))
    width, height = np.ceil((high - low) / cell).astype(int)
    image = np.zeros((height, width), np.uint8)
    for line in np.round((lines - low) / cell).astype(np.int32):
        cv2.line(image, line[0].tolist(), line[1].tolist(), 255)
    found = []
    for number, at in enumerate(np.round((seeds - low) / cell).astype(int).tolist()):
        which = f"room {number}, seed {storey.rooms[number].seed}"
        if image[at[1], at[0]]:
            raise ConfigError(f"{which}: the seed lies on a wall or in another room")
        cv2.floodFill(image, None, at, 100, flags=4)
        region = (image == 100).astype(np.uint8)
        if region[[0, -1]].any() or region[:, [0, -1]].any():
            raise ConfigError(f"{which}: it is open to the outside")
        image[region > 0] = 200
        rings = cv2.findContours(region, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[-2]
        ring = max(rings, key=cv2.contourArea)[:, 0, :] * cell + low
        outer = shapely.make_valid(Polygon(ring)).simplify(cell)
        found.append(shapely.buffer(outer, cell, join_style="mitre"))  # the ring lies in the cells beside the walls
    return [_without_inner(number, found) for number in range(len(found))]


def _without_inner(number: int, rooms: Sequence[Polygon]) -> Polygon:
    """A room without those that lie in it: a hall around a core of rooms."""
    inner = [other for k, other in enumerate(rooms) if k != number and rooms[number].contains(other)]
    return rooms[number].difference(shapely.union_all(inner)) if inner else rooms[number]


def _strokes(storey: Storey) -> Iterable[list[float]]:
    yield from (list(stroke) for stroke in (*storey.walls, *storey.open))
    for door in storey.doors:  # a little into both jambs
        beyond = (np.asarray(door.b) - door.a) / max(float(np.hypot(*np.subtract(door.b, door.a))), 1e-9) * JAMB_M
        yield [*(np.asarray(door.a) - beyond), *(door.b + beyond)]


def compare(truth: Truth, levels: Sequence[Level], plans: Sequence[Mapping[str, Any]]) -> Found:
    """R3, R4: what the plans of a file have of its storeys."""
    whole = Found()
    for storey in truth.storeys:
        doors = [door for door in storey.doors if door.interior]
        level = next((each for each in levels if each.frame.level == storey.level), None)
        of_it = [plan for plan in plans if plan["frame"]["level"] == storey.level]
        if level is None or not np.allclose(extent_of(level), storey.extent, rtol=SAME_EXTENT, atol=SAME_EXTENT):
            of_it = []
        found = [_ring(plan, room) for plan in of_it for room in plan["rooms"]]
        lines = [
            _points(plan, d["segment"]) for plan in of_it for d in plan["doors"] if d["kind"] in {"door", "opening"}
        ]
        ious = _ious(rooms_of(level, storey), found) if level is not None and of_it else np.zeros(0)
        whole += Found(
            len(storey.rooms),
            int((ious >= FOUND_IOU).sum()),
            len(found),
            len(doors),
            found_near([door.middle for door in doors], [line.mean(axis=0) for line in lines], NEAR_WAY_M),
            len(lines),
            float(ious.sum()),
        )
    return whole


def _points(plan: Mapping[str, Any], points: Any) -> Floats:
    matrix = np.asarray(plan["frame"]["matrix"], np.float64)
    return np.asarray(np.asarray(points, np.float64) @ matrix[:, :2].T + matrix[:, 2])


def _ring(plan: Mapping[str, Any], room: Mapping[str, Any]) -> Polygon:
    return Polygon(_points(plan, room["polygon"]), [_points(plan, hole) for hole in room["holes"]]).buffer(0)


def _ious(truth: Sequence[Polygon], found: Sequence[Polygon]) -> Floats:
    """The IoU of each pair, one to one, so that their sum is greatest."""
    if not truth or not found:
        return np.zeros(0)
    one, other = np.array(truth, np.object_)[:, None], np.array(found, np.object_)[None, :]
    shared = shapely.area(shapely.intersection(one, other))
    iou = shared / (shapely.area(one) + shapely.area(other) - shared)
    return np.asarray(iou[linear_sum_assignment(-iou)])
