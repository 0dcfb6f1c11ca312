"""Write the tables of a release as Parquet: plans, rooms, doors and, if there are any, windows and furniture.

Geometry is WKB in the plan's own coordinates in metres (docs/format.md), with polygons counter-clockwise. Columns are
described only here; the data card and the Croissant description repeat these texts.
They are written as Parquet files, in small row groups and with settings that give reproducible bytes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from houseexpo.analysis.audit import PlanAudit
from houseexpo.analysis.geodataframe import place_of
from houseexpo.dataset.index import index_row
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import RADII_M, Door

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Row = dict[str, Any]
IMAGE: Final = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
_STRINGS: Final = pa.list_(pa.string())
_SHARE_RADIUS: Final = "0.20"


class ReleasePlan(NamedTuple):
    """A plan, its part, the group that it must stay with, its picture as a PNG, its audit (None: it has no rooms)."""

    plan: FloorPlan
    split: str
    group: str
    png: bytes
    audit: PlanAudit | None


@dataclass(frozen=True)
class TableColumn:
    """A column: its name, its type, and its description."""

    name: str
    type: Any  # pyarrow has no type annotations
    about: str


@dataclass(frozen=True)
class ReleaseTable:
    """A table; ``geometries`` are its WKB columns with the geometry types that occur, the row's own one first."""

    name: str
    about: str
    columns: tuple[TableColumn, ...]
    geometries: Mapping[str, tuple[str, ...]]
    rows: Callable[[ReleasePlan], Iterator[Row]]


def _plan_rows(placed: ReleasePlan) -> Iterator[Row]:
    plan = placed.plan
    known = index_row(plan)
    reach = known.pop("navigability") or {}
    audit = placed.audit
    named = [*(" ".join(room.source_labels) for room in plan.rooms), *(thing.label for thing in plan.objects)]
    yield {
        **known,
        "split": placed.split,
        "group": placed.group,
        **{_reach_column(radius): (reach.get(f"{radius:.2f}") or {}).get("largest_share") for radius in RADII_M},
        "narrowest": (reach.get(_SHARE_RADIUS) or {}).get("narrowest"),
        "windows": len(plan.windows),
        "stairs": sum(re.search(r"\bstair", words, re.IGNORECASE) is not None for words in named),
        "objects": len(plan.furniture),
        "kind": (plan.provenance or {}).get("kind"),
        "broken_rules": None if audit is None else sorted(audit.broken_rules()),
        "image": {"bytes": placed.png, "path": f"{plan.id}.png"},
        "geometry": encode_wkb(plan.free_space),
    }


def _room_rows(placed: ReleasePlan) -> Iterator[Row]:
    windows = placed.plan.windows
    audited = {} if placed.audit is None else {room.id: room for room in placed.audit.rooms}
    for room in placed.plan.rooms:
        found = audited.get(room.id)
        own = [window for window in windows if room.id in window.rooms]
        yield {
            "plan_id": placed.plan.id,
            "split": placed.split,
            "room": room.id,
            "label": room.label,
            "source_labels": list(room.source_labels),
            "area": round(room.area, 2),
            "windows": len(own),
            "window_area": _window_area(own),
            "clear_width": found and found.width_m,
            "aspect": found and found.aspect,
            "broken_rules": None if found is None else sorted(set(found.broken_rules())),
            "geometry": encode_wkb(room.polygon),
        }


def _door_rows(placed: ReleasePlan) -> Iterator[Row]:
    for door in placed.plan.doors:
        of_plan = {"plan_id": placed.plan.id, "split": placed.split}
        yield {**of_plan, "door": door.id, "kind": door.kind, **_place_of(door)}


def _window_area(windows: Sequence[Door]) -> float | None:
    """Return the area of windows in m2; None if the heights of one are not known."""
    areas = [w.width * (w.head - w.sill) for w in windows if w.sill is not None and w.head is not None]
    return round(sum(areas), 2) if len(areas) == len(windows) else None


def _window_rows(placed: ReleasePlan) -> Iterator[Row]:
    for window in placed.plan.windows:
        of_plan = {"plan_id": placed.plan.id, "split": placed.split}
        yield {**of_plan, "window": window.id, "sill": window.sill, "head": window.head, **_place_of(window)}


def _place_of(opening: Door) -> Row:
    found = place_of(opening)
    return {**found, **{name: encode_wkb(found[name]) for name in ("segment", "geometry")}}


def _object_rows(placed: ReleasePlan) -> Iterator[Row]:
    for thing in placed.plan.objects:
        yield {
            "plan_id": placed.plan.id,
            "split": placed.split,
            "object": thing.id,
            "label": thing.label,
            "room": thing.room,
            "height": thing.height,
            "geometry": encode_wkb(thing.polygon),
        }


def encode_wkb(shape: BaseGeometry) -> bytes:
    """Return a geometry as little-endian WKB, with the outer rings of polygons counter-clockwise."""
    import shapely

    return bytes(shapely.to_wkb(shapely.orient_polygons(shape), byte_order=1, include_srid=False))


def _reach_column(radius_m: float) -> str:
    return f"reached_{round(radius_m * 100):02d}cm"


_OF_PLAN: Final = (
    TableColumn("plan_id", pa.string(), "Id of the plan."),
    TableColumn("split", pa.string(), "The split that contains the plan."),
)
_WIDTH: Final = TableColumn("width", pa.float64(), "From jamb to jamb in metres.")
_SEGMENT: Final = TableColumn("segment", pa.binary(), "From jamb to jamb on the wall's centre line, WKB in metres.")
_REACH: Final = tuple(
    TableColumn(
        _reach_column(radius),
        pa.float64(),
        f"Share of its floor that a round robot of {radius:.2f} m radius can reach.",
    )
    for radius in RADII_M
)
PLANS: Final = ReleaseTable(
    "plans",
    "One row per floor plan (one level of a house).",
    (
        TableColumn("id", pa.string(), "Name of the plan; its JSON is json/<id>.json in json.tar.gz."),
        TableColumn("split", pa.string(), "The split that contains the plan."),
        TableColumn("group", pa.string(), "First id of the plans of the same house; a group is in one split."),
        TableColumn("rooms", pa.int32(), "Rooms that the plan has."),
        TableColumn("source_rooms", pa.int32(), "Rooms of the level as its source counts them."),
        TableColumn("area", pa.float64(), "Free space in m2."),
        TableColumn("width", pa.float64(), "Extent along x in metres."),
        TableColumn("height", pa.float64(), "Extent along y in metres."),
        TableColumn("labels", _STRINGS, "Labels of rooms that occur, sorted."),
        TableColumn("doors", pa.int32(), "Doors of every kind."),
        TableColumn("cuts", pa.int32(), "Doors that were cut to connect parts without a door."),
        TableColumn("windows", pa.int32(), "Windows; 0 also if the source names none."),
        TableColumn("stairs", pa.int32(), "Rooms and objects that the source calls stairs."),
        TableColumn("objects", pa.int32(), "Pieces of furniture."),
        *_REACH,
        TableColumn(
            "narrowest", pa.float64(), "Narrowest passage that a robot of 0.20 m radius has to use, in metres."
        ),
        TableColumn("quality", pa.float64(), "The pipeline's confidence in the plan, 0 to 1."),
        TableColumn("source", pa.string(), "Kind of file that the plan was made from."),
        TableColumn("level", pa.int32(), "Number of the level in its house."),
        TableColumn("kind", pa.string(), "Kind of dwelling that a made house is; empty for other sources."),
        TableColumn(
            "broken_rules",
            _STRINGS,
            "Rules of real homes that the plan breaks (houseexpo stats --audit); empty if it has no rooms.",
        ),
        TableColumn("image", IMAGE, "A picture of the plan, PNG; path is a name for it."),
        TableColumn("geometry", pa.binary(), "Free space, WKB in metres: a polygon with its holes."),
    ),
    {"geometry": ("Polygon", "MultiPolygon")},
    _plan_rows,
)
ROOMS: Final = ReleaseTable(
    "rooms",
    "One row per room.",
    (
        *_OF_PLAN,
        TableColumn("room", pa.int32(), "Number of the room in its plan."),
        TableColumn("label", pa.string(), "One of the 25 labels, or Unlabelled."),
        TableColumn("source_labels", _STRINGS, "The words of the source."),
        TableColumn("area", pa.float64(), "Floor in m2."),
        TableColumn("windows", pa.int32(), "Windows in its walls."),
        TableColumn("window_area", pa.float64(), "Their area in m2; empty if their heights are not known."),
        TableColumn(
            "clear_width", pa.float64(), "Diameter of the largest circle inside, in metres, without furniture."
        ),
        TableColumn("aspect", pa.float64(), "Ratio of the sides of the smallest rotated rectangle round it."),
        TableColumn("broken_rules", _STRINGS, "Rules that the room breaks: area, width, aspect, light."),
        TableColumn("geometry", pa.binary(), "The room, WKB in metres."),
    ),
    {"geometry": ("Polygon",)},
    _room_rows,
)
DOORS: Final = ReleaseTable(
    "doors",
    "One row per door or opening.",
    (
        *_OF_PLAN,
        TableColumn("door", pa.int32(), "Number of the door in its plan."),
        TableColumn("kind", pa.string(), "door, opening, entrance (leads outside, closed) or cut."),
        _WIDTH,
        TableColumn("room_a", pa.int32(), "A room that it leads to."),
        TableColumn("room_b", pa.int32(), "The other room; empty if it leads outside."),
        TableColumn("geometry", pa.binary(), "The area between the wall's two faces, WKB in metres."),
        _SEGMENT,
    ),
    {"geometry": ("Polygon",), "segment": ("LineString",)},
    _door_rows,
)
WINDOWS: Final = ReleaseTable(
    "windows",
    "One row per window.",
    (
        *_OF_PLAN,
        TableColumn("window", pa.int32(), "Number of the window in its plan."),
        _WIDTH,
        TableColumn("sill", pa.float64(), "Height of its lower edge above the floor, in metres."),
        TableColumn("head", pa.float64(), "Height of its upper edge above the floor, in metres."),
        TableColumn("room_a", pa.int32(), "A room that it gives light."),
        TableColumn("room_b", pa.int32(), "The room behind it; empty if it looks outside."),
        TableColumn("geometry", pa.binary(), "The area between the wall's two faces, WKB in metres; not free space."),
        _SEGMENT,
    ),
    {"geometry": ("Polygon",), "segment": ("LineString",)},
    _window_rows,
)
OBJECTS: Final = ReleaseTable(
    "objects",
    "One row per piece of furniture.",
    (
        *_OF_PLAN,
        TableColumn("object", pa.int32(), "Number of the piece in its plan."),
        TableColumn("label", pa.string(), "Kind of furniture."),
        TableColumn("room", pa.int32(), "Number of the room that it stands in."),
        TableColumn("height", pa.float64(), "Above the floor, in metres."),
        TableColumn("geometry", pa.binary(), "Its footprint, WKB in metres; not free space."),
    ),
    {"geometry": ("Polygon",)},
    _object_rows,
)
TABLES: Final = (PLANS, ROOMS, DOORS, WINDOWS, OBJECTS)


def arrow_schema(table: ReleaseTable) -> Any:
    """Return the Arrow schema with the file metadata that GeoParquet 1.1 and Hugging Face read."""
    import json

    columns = {
        name: {
            "encoding": "WKB",
            "geometry_types": list(kinds),
            "crs": None,
            "edges": "planar",
            **({"orientation": "counterclockwise"} if "Polygon" in kinds else {}),
        }
        for name, kinds in table.geometries.items()
    }
    geo = {"version": "1.1.0", "primary_column": next(iter(table.geometries)), "columns": columns}
    images = {column.name: {"_type": "Image"} for column in table.columns if column.type == IMAGE}
    metadata = {"geo": json.dumps(geo, separators=(",", ":"))}
    if images:
        metadata["huggingface"] = json.dumps({"info": {"features": images}}, separators=(",", ":"))
    return pa.schema([(column.name, column.type) for column in table.columns], metadata=metadata)


GROUP_BYTES: Final = 32 * 2**20
"""A row group is closed at this size; the last rows that are added may exceed it a little."""

GROUP_ROWS: Final = 10_000


class TableWriter:
    """A context manager that writes one file of a table, one row group at a time."""

    def __init__(self, file: Path, table: ReleaseTable) -> None:
        self._schema = arrow_schema(table)
        words = [column.name for column in table.columns if column.type == pa.string()]
        self._writer: Any = pq.ParquetWriter(
            file,
            self._schema,
            version="2.6",
            data_page_version="1.0",
            compression="zstd",
            compression_level=3,
            use_dictionary=words,
            write_page_index=True,
        )
        self._waiting: list[Any] = []
        self._bytes = 0
        self.rows = 0

    def __enter__(self) -> TableWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._flush()
        self._writer.close()

    def add(self, rows: Sequence[Row]) -> None:
        """Add rows, in order."""
        batch = pa.RecordBatch.from_pylist(list(rows), schema=self._schema)
        self._waiting.append(batch)
        self._bytes += batch.nbytes
        self.rows += batch.num_rows
        if self._bytes >= GROUP_BYTES or sum(waiting.num_rows for waiting in self._waiting) >= GROUP_ROWS:
            self._flush()

    def _flush(self) -> None:
        table = pa.Table.from_batches(self._waiting, schema=self._schema)
        if table.num_rows:
            self._writer.write_table(table, row_group_size=table.num_rows)
        self._waiting, self._bytes = [], 0
