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


@lru_cache(maxsize=8)
def _names(*keys: str) -> list[str]:
    """Return the names of the masks that say of which environments an info speaks."""
    return [f"_{key}" for key in keys]
