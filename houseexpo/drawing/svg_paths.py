"""Rings as SVG path data."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt


def path_data(rings: Iterable[npt.NDArray[np.float64]], number: Callable[[float], str]) -> str:
    """Return rings (n, 2) as closed subpaths, with y down as in SVG; ``number`` formats a coordinate."""
    return " ".join(
        "M" + " ".join(f"{number(x)},{number(y)}" for x, y in np.asarray(ring).tolist()) + "Z" for ring in rings
    )
