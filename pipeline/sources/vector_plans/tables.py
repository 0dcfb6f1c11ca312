"""Read, plan by plan, a file of many: Swiss Dwellings and MSD (``geometries.csv``), and ResPlan (``ResPlan.pkl``).

Formats: Swiss Dwellings 3.0 (a row a shape: floor_id, entity_type area, separator, opening or feature,
entity_subtype, geometry as WKT, metres); Modified Swiss Dwellings, the same with ``geom``; ResPlan (a list of plans,
each a mapping of room kinds, wall, door, front_door, window and inner to shapely geometries in units of its own, and
``area`` in square metres).

R1  A plan of a table is a floor: all rows of one ``floor_id``.
R2  ResPlan's scale is the root of ``area`` over the area of ``inner``; a plan without either is refused.
R3  A pickle is read without running anything of it: of all globals that it may name, only shapely's geometries are
    made, by our own hands; numbers of numpy become numbers; what else numpy, networkx and collections have
    becomes nothing; any other name ends the reading.
"""

from __future__ import annotations

import csv
import io
import math
import pickle
import struct
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np
import shapely

from pipeline.geometry.areas import drop_lines_and_points
from pipeline.rejection import Reason, Rejection
from pipeline.sources.files import LeftOutParts
from pipeline.sources.tolerances import FILE_GRID_M, LARGEST_FLOOR_M2
from pipeline.sources.vector_plans.drawing import Drawing, Feature
from pipeline.sources.vector_plans.named_features import storey_from_features
from pipeline.tolerances import SAME

LARGEST_TABLE_BYTES = 1 << 31
_ADVICE = "copy it again from the data set"
_GEOMETRY: Final = ("geometry", "geom")
_WALLS: Final = frozenset({"WALL", "COLUMN", "RAILING"})
_DOORS: Final = frozenset({"DOOR", "ENTRANCE_DOOR"})
_ROOMS: Final = {
    "STOREROOM": "Storage",
    "CORRIDORS_AND_HALLS": "Hallway",
    "LIVING_DINING": "Living_Room",
    "KITCHEN_DINING": "Kitchen",
    "STAIRCASE": "",
    "ELEVATOR": "Passenger_elevator",
    "NOT_DEFINED": "",
    "living": "Living_Room",
    "bedroom": "Bedroom",
    "bathroom": "Bathroom",
    "kitchen": "Kitchen",
    "balcony": "Balcony",
    "storage": "Storage",
    "stair": "",
    "veranda": "Terrace",
    "garden": "",
    "parking": "Garage",
}
_COLLECTION: Final = (b"\x01\x07\x00\x00\x00", b"\x00\x00\x00\x00\x07")
"""How a collection begins in WKB, in either order of bytes."""
_RESPLAN_ROOMS: Final = ("living", "bedroom", "bathroom", "kitchen", "balcony", "storage", "stair", "veranda")


def can_read(path: Path, head: bytes) -> bool:
    """By the columns of the table, or by the first bytes of a pickle that names shapely."""
    suffix = path.suffix.lower()
    if suffix == ".csv":
        first = head.split(b"\n", 1)[0]
        return b"entity_subtype" in first and b"floor_id" in first
    return suffix in {".pkl", ".pickle"} and head[:1] == b"\x80"


def list_plan_names(path: Path) -> list[str]:
    """Return the names of the plans in a file; raise Rejection if it cannot be read."""
    return list(_plans(path))


def read_drawing(path: Path, key: str = "") -> Drawing:
    """Read one plan of a file; raise Rejection if it cannot be read or has no such plan."""
    plans = _plans(path)
    found = plans.get(key) if key else next(iter(plans.values()), None)
    if found is None:
        raise Rejection("source", Reason.NO_LEVEL, f"{path.name} holds no plan {key[:40]!r}", _ADVICE)
    if path.suffix.lower() == ".csv":
        return _floor(found)
    return _resplan(found, path, key)


def _plans(path: Path) -> Mapping[str, Any]:
    status = path.stat()
    if status.st_size > LARGEST_TABLE_BYTES:
        raise Rejection("source", Reason.TOO_LARGE, f"{path.name} has {status.st_size >> 20} MB", "divide it")
    return _read(str(path), status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=1)
def _read(path: str, _modified: int, _size: int) -> Mapping[str, Any]:
    """Return the plans of a file, which is read once for all of them."""
    return _table(Path(path)) if path.lower().endswith(".csv") else _read_pickle(Path(path))


def _table(path: Path) -> dict[str, list[tuple[str, str, str]]]:
    """R1: (entity_type, entity_subtype, WKT) of each row, by floor."""
    csv.field_size_limit(min(sys.maxsize, 1 << 26))
    floors: dict[str, list[tuple[str, str, str]]] = {}
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            for row in csv.DictReader(stream):
                shape = next((row[name] for name in _GEOMETRY if row.get(name)), "")
                key = str(row.get("floor_id") or "")
                floors.setdefault(key, []).append(
                    (row.get("entity_type") or "", row.get("entity_subtype") or "", shape)
                )
    except (csv.Error, UnicodeDecodeError) as error:
        raise Rejection("source", Reason.UNREADABLE, f"{path.name}: {str(error)[:120]}", _ADVICE) from None
    return floors


def _floor(rows: list[tuple[str, str, str]]) -> Drawing:
    left_out = LeftOutParts()
    features, walls = [], []
    texts = [text if text.upper().count("COLLECTION") < 2 else "" for _, _, text in rows]  # nested ones end GEOS
    shapes = shapely.from_wkt(texts, on_invalid="ignore")
    for number, ((kind, subtype, _), given) in enumerate(zip(rows, shapes, strict=True)):
        shape, word = _area(given), subtype.replace("_", " ").lower()
        if shape is None:
            left_out.add(f"row {number} of the floor, {subtype[:30]}, has no area that can be read")
        elif subtype in _WALLS:
            walls.append(shape)
        elif subtype in _DOORS:
            features.append(Feature("door", shape))
        elif kind == "area":
            features.append(Feature("room", shape, (word,), (_ROOMS.get(subtype, word),)))
        elif kind == "feature":
            features.append(Feature("object", shape, (subtype.lower(),)))
    features.append(Feature("wall", shapely.union_all(walls, grid_size=FILE_GRID_M)))
    return Drawing("swiss-dwellings", (storey_from_features(features),), left_out)


def _resplan(found: Any, path: Path, key: str) -> Drawing:
    """R2."""
    plan = {str(name).lower(): value for name, value in found.items()} if isinstance(found, dict) else {}
    parts = {name: shape for name, value in plan.items() if (shape := _area(value)) is not None}
    inner = parts["inner"].area if "inner" in parts else 0.0
    area = plan.get("area")
    if not isinstance(area, int | float) or not 1 < area < LARGEST_FLOOR_M2 or not inner > 0:
        detail = f"{path.name}: plan {key[:40]} has no area and inner, which give its scale"
        raise Rejection("source", Reason.BAD_UNITS, detail, "leave the plan out")
    features = [Feature("wall", parts["wall"])] if "wall" in parts else []
    features += [Feature("door", parts[name]) for name in ("door", "front_door") if name in parts]
    features += [Feature("room", parts[name], (name,), (_ROOMS[name],)) for name in _RESPLAN_ROOMS if name in parts]
    storey = storey_from_features(features, to_metres=math.sqrt(float(area) / inner))
    return Drawing("resplan", (storey,), LeftOutParts())


def _area(shape: Any) -> Any:
    """Return the area of a geometry in two dimensions; None if it has none."""
    if isinstance(shape, _Shape):
        shape = shape.geometry
    if not isinstance(shape, shapely.Geometry) or shape.is_empty or not np.isfinite(shapely.bounds(shape)).all():
        return None
    found = drop_lines_and_points(shapely.make_valid(shapely.force_2d(shape)))
    return found if found.area > SAME else None


class _Shape:
    """A geometry of shapely as its WKB (shapely 1: as state; shapely 2: as an argument), parsed when asked."""

    def __init__(self, *arguments: Any) -> None:
        self.data: Any = arguments[0] if arguments else b""

    def __setstate__(self, state: Any) -> None:
        self.data = state

    @property
    def geometry(self) -> Any:
        """Return the geometry, or None. Collections give None, because deeply nested ones crash GEOS."""
        data = self.data if isinstance(self.data, bytes) else b""
        return None if data.startswith(_COLLECTION) else shapely.from_wkb(data, on_invalid="ignore")


class _Nothing:
    """What stands for a thing that no plan needs: it takes whatever a pickle gives it, and keeps none of it."""

    def __new__(cls, *_: Any, **__: Any) -> _Nothing:
        return super().__new__(cls)

    def __init__(self, *_: Any, **__: Any) -> None: ...

    def __setstate__(self, _: Any) -> None: ...

    def __setitem__(self, _: Any, __: Any) -> None: ...

    def __call__(self, *_: Any, **__: Any) -> _Nothing:
        return self

    def append(self, _: Any) -> None:
        """Take a part."""

    def extend(self, _: Any) -> None:
        """Take parts."""


class _Kind:
    """numpy's dtype, of which only its name counts."""

    def __init__(self, name: Any = "", *_: Any) -> None:
        self.name = name if isinstance(name, str) else ""

    def __setstate__(self, _: Any) -> None: ...


def _scalar(kind: Any, data: Any = b"") -> Any:
    """A number of numpy."""
    formats = {"f8": "<d", "f4": "<f", "i8": "<q", "i4": "<i", "u1": "<B", "b1": "<?"}
    form = formats.get(kind.name.lstrip("<|=")) if isinstance(kind, _Kind) else None
    good = form is not None and isinstance(data, bytes) and len(data) == struct.calcsize(form)
    return struct.unpack(form, data)[0] if good and form else _Nothing()


class _Reader(pickle._Unpickler):  # noqa: SLF001 - the compiled one's memo can be blown up
    """R3.

    What no plan has is refused, since it can cost any time or memory: sets, byte arrays of an announced length, and
    keys of a mapping that hold more than names and numbers (the hash of a tuple of tuples takes no end).
    """

    dispatch: ClassVar[dict[int, Any]] = dict(pickle._Unpickler.dispatch)  # noqa: SLF001

    def _refuse(self) -> None:
        raise pickle.UnpicklingError("it has a set or a byte array, which no plan needs")

    for _code in (pickle.EMPTY_SET, pickle.ADDITEMS, pickle.FROZENSET, pickle.BYTEARRAY8):
        dispatch[_code[0]] = _refuse

    def _check_keys(self, keys: Sequence[Any]) -> None:
        flat = [part for key in keys for part in (key if isinstance(key, tuple) else (key,))]
        if any(isinstance(part, tuple) or (isinstance(part, int) and part.bit_length() > 64) for part in flat):
            raise pickle.UnpicklingError("it has a mapping whose keys are no names or numbers")

    def load_setitem(self) -> None:
        """Put one pair into a mapping."""
        self._check_keys(self.stack[-2:-1])  # type: ignore[attr-defined]
        super().load_setitem()  # type: ignore[misc]

    def load_setitems(self) -> None:
        """Put pairs into a mapping."""
        self._check_keys(self.stack[::2])  # type: ignore[attr-defined]
        super().load_setitems()  # type: ignore[misc]

    def load_dict(self) -> None:
        """Make a mapping of pairs."""
        self._check_keys(self.stack[::2])  # type: ignore[attr-defined]
        super().load_dict()  # type: ignore[misc]

    dispatch[pickle.SETITEM[0]], dispatch[pickle.SETITEMS[0]] = load_setitem, load_setitems
    dispatch[pickle.DICT[0]] = load_dict

    def find_class(self, module: str, name: str) -> Any:
        """Return what stands for a name; raise UnpicklingError for any that is not listed."""
        root = module.split(".", maxsplit=1)[0]
        if root == "shapely" and (name in {"from_wkb", "loads"} or module.startswith("shapely.geometry")):
            return _Shape
        if root == "numpy":
            return {"dtype": _Kind, "scalar": _scalar}.get(name, _Nothing)
        if root == "networkx" or (root == "collections" and name in {"OrderedDict", "defaultdict"}):
            return _Nothing
        raise pickle.UnpicklingError(f"it names {module[:60]}.{name[:60]}, which no plan needs")

    def persistent_load(self, _: Any) -> Any:
        """Nothing is loaded from elsewhere."""
        raise pickle.UnpicklingError("it refers to something outside of it")


def _read_pickle(path: Path) -> dict[str, Any]:
    try:
        return dict(_plans_of(_Reader(io.BytesIO(path.read_bytes())).load()))
    except Exception as error:  # noqa: BLE001 - broken bytes lead the reader to any
        detail = f"{path.name} is not read: {str(error)[:160] or type(error).__name__}"
        raise Rejection("source", Reason.UNREADABLE, detail, "take it from the data set itself") from None


def _plans_of(found: Any) -> Iterator[tuple[str, Any]]:
    plans = found if isinstance(found, list) else [found] if isinstance(found, dict) and "wall" in found else found
    pairs = plans.items() if isinstance(plans, dict) else enumerate(plans) if isinstance(plans, list) else ()
    for number, plan in pairs:
        if isinstance(plan, dict):
            mark = plan.get("id", number)
            yield str(mark if isinstance(mark, int | str) else number)[:60], plan
