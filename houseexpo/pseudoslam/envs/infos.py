"""What ``info`` of a vector environment holds: an array for each key and, as ``_key``, whom it speaks of."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt


def infos_of(report: dict[str, npt.NDArray[Any]], which: npt.NDArray[np.bool_]) -> dict[str, Any]:
    """Return what is said of N environments, arrays of N, with a mask for each key: those of ``which``."""
    masks = np.empty((len(report), len(which)), bool)
    masks[:] = which
    return {**report, **dict(zip(_names(*report), masks, strict=True))}


def last_of(
    observed: npt.NDArray[Any] | dict[str, npt.NDArray[Any]], which: npt.NDArray[np.bool_]
) -> npt.NDArray[np.object_]:
    """Return (N,) what was observed of those that ended, copies of their own, and None of the others."""
    last = np.full(len(which), None, object)
    for i in np.flatnonzero(which).tolist():
        if isinstance(observed, dict):
            last[i] = {key: part[i].copy() for key, part in observed.items()}
        else:
            last[i] = observed[i].copy()
    return last


@lru_cache(maxsize=8)
def _names(*keys: str) -> list[str]:
    """Return the names of the masks that say of which environments an info speaks."""
    return [f"_{key}" for key in keys]
