"""Make a GeoPandas table of plans, or of their rooms, doors, windows, walls or furniture, with a geometry in each row.

Columns have the same names as in the tables of a release (``houseexpo.release.tables``). Geometries are shapely's, in
metres.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, Final, Literal, TypeAlias, get_args

from houseexpo.analysis.walls import walls_around
from houseexpo.errors import ConfigError, MissingDependencyError, install_command
from houseexpo.plan import Door
from houseexpo.plan.model import PlanData

Layer: TypeAlias = Literal["plans", "rooms", "doors", "windows", "walls", "objects"]
Row: TypeAlias = dict[str, Any]

_OUTLINE_WALL_M: Final = 0.1
"""Thickness of the walls, as ``FloorPlan.walls`` has it by default."""


def _plans(plan: PlanData) -> Iterator[Row]:
    yield {
        "id": plan.id,
        "rooms": len(plan.rooms),
        "source_rooms": plan.room_num,
        "area": round(plan.area, 2),
        "doors": len(plan.doors),
        "windows": len(plan.windows),
        "objects": len(plan.furniture),
        "quality": None if plan.quality is None else plan.quality.score,
        "geometry": plan.free_space,
    }


def _rooms(plan: PlanData) -> Iterator[Row]:
    for room in plan.rooms:
        yield {
            "plan_id": plan.id,
            "room": room.id,
            "label": room.label,
            "source_labels": list(room.source_labels),
            "area": round(room.area, 2),
            "geometry": room.polygon,
        }


def _doors(plan: PlanData) -> Iterator[Row]:
    for door in plan.doors:
        yield {"plan_id": plan.id, "door": door.id, "kind": door.kind, **place_of(door)}


def _windows(plan: PlanData) -> Iterator[Row]:
    for window in plan.windows:
        yield {"plan_id": plan.id, "window": window.id, "sill": window.sill, "head": window.head, **place_of(window)}


def place_of(opening: Door) -> Row:
    """Return the columns that doors and windows share: width, the rooms beside them, segment and geometry, metres."""
    import shapely

    return {
        "width": opening.width,
        "room_a": opening.rooms[0],
        "room_b": opening.rooms[1],
        "segment": shapely.LineString(opening.segment),
        "geometry": opening.polygon,
    }


def _walls(plan: PlanData) -> Iterator[Row]:
    for wall in walls_around(plan.floor, _OUTLINE_WALL_M):
        yield {"plan_id": plan.id, "area": round(wall.area, 2), "geometry": wall}


def _objects(plan: PlanData) -> Iterator[Row]:
    for thing in plan.objects:
        yield {
            "plan_id": plan.id,
            "object": thing.id,
            "label": thing.label,
            "room": thing.room,
            "height": thing.height,
            "geometry": thing.polygon,
        }


_LAYERS: Final[dict[str, tuple[Callable[[PlanData], Iterator[Row]], tuple[str, ...]]]] = {
    "plans": (_plans, ("id", "rooms", "source_rooms", "area", "doors", "windows", "objects", "quality", "geometry")),
    "rooms": (_rooms, ("plan_id", "room", "label", "source_labels", "area", "geometry")),
    "doors": (_doors, ("plan_id", "door", "kind", "width", "room_a", "room_b", "segment", "geometry")),
    "windows": (
        _windows,
        ("plan_id", "window", "width", "sill", "head", "room_a", "room_b", "segment", "geometry"),
    ),
    "walls": (_walls, ("plan_id", "area", "geometry")),
    "objects": (_objects, ("plan_id", "object", "label", "room", "height", "geometry")),
}


def make_geodataframe(plans: Iterable[PlanData], layer: Layer) -> Any:
    """Return one layer of some plans as a ``geopandas.GeoDataFrame``, one row each, in metres, without a CRS.

    Raises
    ------
    ConfigError
        ``layer`` is not the name of a layer.
    MissingDependencyError
        GeoPandas is not installed.
    """
    if layer not in _LAYERS:
        raise ConfigError(f"layer: expected one of {', '.join(get_args(Layer))}, found {layer!r}")
    try:
        import geopandas
    except ImportError:
        raise MissingDependencyError(f"to_geopandas needs GeoPandas: {install_command('frames')}") from None
    rows, columns = _LAYERS[layer]
    found = [row for plan in plans for row in rows(plan)]
    return geopandas.GeoDataFrame(found, columns=list(columns), geometry="geometry", crs=None)
