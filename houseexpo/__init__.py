"""HouseExpo: 2D floor plans for robots that learn.

The names below are imported when they are first used, so that ``import houseexpo`` stays quick.

Examples
--------
>>> import houseexpo
>>> houseexpo.canonical("living room")
'Living_Room'
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from houseexpo.categories import LABELS, UNLABELLED, canonical
    from houseexpo.dataset import Dataset, open_dataset
    from houseexpo.drawing import contact_sheet, draw_plan, svg
    from houseexpo.errors import (
        ConfigError,
        DatasetError,
        HouseExpoError,
        MissingDependencyError,
        PlanError,
        UnknownPlanError,
    )
    from houseexpo.fetch import fetch
    from houseexpo.files import load_plan, save_plan
    from houseexpo.frame import GridFrame
    from houseexpo.graph import navigability, rooms_graph
    from houseexpo.inference import with_rooms
    from houseexpo.plan import Door, FloorPlan, Frame, Navigability, PlanObject, Quality, Room
    from houseexpo.plan_json import decode, encode
    from houseexpo.raster import door_mask, free_mask, room_mask
    from houseexpo.repair import Repair
    from houseexpo.similarity import find_duplicates

_HOME = {
    "categories": ("LABELS", "UNLABELLED", "canonical"),
    "dataset": ("Dataset", "open_dataset"),
    "drawing": ("contact_sheet", "draw_plan", "svg"),
    "errors": (
        "ConfigError",
        "DatasetError",
        "HouseExpoError",
        "MissingDependencyError",
        "PlanError",
        "UnknownPlanError",
    ),
    "fetch": ("fetch",),
    "files": ("load_plan", "save_plan"),
    "frame": ("GridFrame",),
    "graph": ("navigability", "rooms_graph"),
    "inference": ("with_rooms",),
    "plan": ("Door", "FloorPlan", "Frame", "Navigability", "PlanObject", "Quality", "Room"),
    "plan_json": ("decode", "encode"),
    "raster": ("door_mask", "free_mask", "room_mask"),
    "repair": ("Repair",),
    "similarity": ("find_duplicates",),
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = [
    "LABELS",
    "UNLABELLED",
    "ConfigError",
    "Dataset",
    "DatasetError",
    "Door",
    "FloorPlan",
    "Frame",
    "GridFrame",
    "HouseExpoError",
    "MissingDependencyError",
    "Navigability",
    "PlanError",
    "PlanObject",
    "Quality",
    "Repair",
    "Room",
    "UnknownPlanError",
    "canonical",
    "contact_sheet",
    "decode",
    "door_mask",
    "draw_plan",
    "encode",
    "fetch",
    "find_duplicates",
    "free_mask",
    "load_plan",
    "navigability",
    "open_dataset",
    "room_mask",
    "rooms_graph",
    "save_plan",
    "svg",
    "with_rooms",
]


def __getattr__(name: str) -> Any:
    """Import a public name where it lives (PEP 562)."""
    module = _MODULE_OF.get(name)
    if module is None:
        raise AttributeError(f"module 'houseexpo' has no attribute {name!r}")
    value = getattr(import_module(f"houseexpo.{module}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
