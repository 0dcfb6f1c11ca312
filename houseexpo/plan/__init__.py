"""The plan as data: values checked on construction, their JSON, their repair, and the rules of the file format.

Nothing here imports a higher layer; ``houseexpo.FloorPlan`` offers the functions of those as methods.
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
    NavigabilityByRadius,
    PlanObject,
    Quality,
    Ring,
    Room,
)

__all__ = [
    "DOOR_KINDS",
    "RADII_M",
    "Box",
    "Door",
    "DoorKind",
    "Frame",
    "Navigability",
    "NavigabilityByRadius",
    "PlanData",
    "PlanObject",
    "Quality",
    "Ring",
    "Room",
]
