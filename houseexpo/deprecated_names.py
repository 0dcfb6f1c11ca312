"""Keep old names of functions and columns in use for one version; each use warns and names the new one."""

from __future__ import annotations

import warnings
from typing import Final

import numpy as np
import numpy.typing as npt

from houseexpo.grids import raster
from houseexpo.grids.frame import GridFrame
from houseexpo.plan.model import PlanData

OLD_COLUMNS: Final = {"room_num": "source_rooms", "n_doors": "doors", "n_cuts": "cuts"}
"""The columns of the index that the last version named differently."""


def current_column(name: str) -> str:
    """Return the name of a column of the index; one of the last version is deprecated."""
    if name in OLD_COLUMNS:
        _warn(f"column {name!r}", f"{OLD_COLUMNS[name]!r}", stacklevel=4)
    return OLD_COLUMNS.get(name, name)


def room_mask(plan: PlanData, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Return ``room_ids`` of a plan; deprecated."""
    _warn("houseexpo.room_mask", "houseexpo.room_ids")
    return raster.room_ids(plan, frame)


def door_mask(plan: PlanData, frame: GridFrame) -> npt.NDArray[np.int32]:
    """Return ``door_ids`` of a plan; deprecated."""
    _warn("houseexpo.door_mask", "houseexpo.door_ids")
    return raster.door_ids(plan, frame)


def _warn(old: str, new: str, stacklevel: int = 3) -> None:
    words = f"{old} is now {new}; the old name will be removed in the next version"
    warnings.warn(words, DeprecationWarning, stacklevel=stacklevel)
