"""Offer plans as a PyTorch data set of tensors of one size: free cells (1), ids of rooms and doors (-1 for none).

PyTorch is imported only when a ``PlanDataset`` is created.

>>> import houseexpo.torch  # needs no torch
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from houseexpo.dataset import Dataset, open_dataset
from houseexpo.dataset.plan_rasters import RasterConfig, rasterise_plan
from houseexpo.errors import MissingDependencyError


class PlanDataset:
    """A map-style data set for ``torch.utils.data.DataLoader``: dictionaries of tensors, all of one size.

    ========  =====================  ==================================================
    key       tensor                 meaning
    ========  =====================  ==================================================
    free      uint8 (1, rows, cols)  1 where free
    rooms     int64 (rows, cols)     id of the room, -1 where there is none
    doors     int64 (rows, cols)     id of the door, -1 where there is none
    index     int64 ()               number of the plan in ``plans``
    ========  =====================  ==================================================

    It is pickled as a path and ids, so that loader processes share the cached store and copy no plan.

    Parameters
    ----------
    plans
        A data set, or a path to open.
    config
        Size, resolution, and how to treat plans that are too large.

    Raises
    ------
    MissingDependencyError
        PyTorch is not installed.
    """

    def __init__(self, plans: Dataset | str | os.PathLike[str], config: RasterConfig | None = None) -> None:
        self._torch = _torch()
        self.plans = plans if isinstance(plans, Dataset) else open_dataset(plans)
        self.config = config or RasterConfig()

    def __len__(self) -> int:
        return len(self.plans)

    def __getitem__(self, index: int) -> dict[str, Any]:
        found = rasterise_plan(self.plans[index], self.config)
        from_numpy = self._torch.from_numpy
        return {
            "free": from_numpy(found.free[None].copy()),
            "rooms": from_numpy(found.rooms.astype(np.int64)),
            "doors": from_numpy(found.doors.astype(np.int64)),
            "index": self._torch.tensor(range(len(self))[index]),
        }

    def __reduce__(self) -> tuple[Any, ...]:
        return PlanDataset, (self.plans, self.config)

    def __repr__(self) -> str:
        rows, cols = self.config.size
        return f"PlanDataset({self.plans!r}, {rows} x {cols} at {self.config.pixels_per_metre:g} px/m)"


def _torch() -> Any:
    try:
        import torch
    except ImportError:
        raise MissingDependencyError(
            "houseexpo.torch: expected PyTorch, found none; install it (pip install torch), or use "
            "houseexpo.dataset.plan_rasters.rasterise_plan, which gives the same as NumPy arrays"
        ) from None
    return torch
