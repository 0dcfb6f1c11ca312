"""The ``info`` of a vector environment: an array for each key and, as ``_key``, a mask of its environments."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt


def infos_of(report: dict[str, npt.NDArray[Any]], which: npt.NDArray[np.bool_]) -> dict[str, Any]:
    """Return the info for arrays of N values, with the mask ``which`` for each key."""
    masks = np.empty((len(report), len(which)), bool)
    masks[:] = which
    return {**report, **dict(zip(_names(*report), masks, strict=True))}


def last_of(
    observed: npt.NDArray[Any] | dict[str, npt.NDArray[Any]], which: npt.NDArray[np.bool_]
) -> npt.NDArray[np.object_]:
    """Return copies of the observations of the environments ``which``, and None for the others (N,)."""
    last = np.full(len(which), None, object)
    for i in np.flatnonzero(which).tolist():
        if isinstance(observed, dict):
            last[i] = {key: part[i].copy() for key, part in observed.items()}
        else:
            last[i] = observed[i].copy()
    return last


@lru_cache(maxsize=8)
def _names(*keys: str) -> list[str]:
    """Return the names of the masks of these keys."""
    return [f"_{key}" for key in keys]
