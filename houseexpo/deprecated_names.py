"""Keep functions callable under their old names, for one version; each call warns and names the new function."""

from __future__ import annotations

import warnings

import numpy as np
import numpy.typing as npt

from houseexpo.grids import raster
from houseexpo.grids.frame import GridFrame
from houseexpo.plan.model import PlanData


def room_mask(plan: PlanData, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Return ``room_ids`` of a plan; deprecated."""
    _warn("room_mask", "room_ids")
    return raster.room_ids(plan, frame)


def door_mask(plan: PlanData, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Return ``door_ids`` of a plan; deprecated."""
    _warn("door_mask", "door_ids")
    return raster.door_ids(plan, frame)


def _warn(old: str, new: str) -> None:
    words = f"houseexpo.{old} is now houseexpo.{new}; the old name will be removed in the next version"
    warnings.warn(words, DeprecationWarning, stacklevel=3)
