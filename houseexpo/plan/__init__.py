"""The plan as data: values checked when made, their JSON, their repair, and the rules that a file must keep.

Nothing here imports a higher floor; ``houseexpo.FloorPlan`` offers what those do as methods.
"""

from houseexpo.plan.model import PlanData
from houseexpo.plan.parts import (
    DOOR_KINDS,
    RADII_M,
    Box,
    Door,
    DoorKind,
    Frame,
    Navigability,
    PlanObject,
    Reach,
    Ring,
    Room,
)
from houseexpo.plan.quality import Quality

__all__ = [
    "DOOR_KINDS",
    "RADII_M",
    "Box",
    "Door",
    "DoorKind",
    "Frame",
    "Navigability",
    "PlanData",
    "PlanObject",
    "Quality",
    "Reach",
    "Ring",
    "Room",
]
