"""The arrays of ``kernels.episode.Episode``, of one episode or in pools with an additional first axis.

Some arrays are fields of an episode itself, others are in tuples of arrays that are its fields. There is no deeper
nesting.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.kernels.episode import Episode

Array = npt.NDArray[Any]

RASTERS, MAP, SHOWN = 3, Episode._fields.index("known"), Episode._fields.index("shown")
"""The number of arrays that have the size of the house, which are flat in a pool; and the map's and view's numbers."""


def flatten(episode: Episode) -> list[Array]:
    """Return the arrays of an episode as a flat list."""
    found: list[Array] = []
    for part in episode:
        if isinstance(part, np.ndarray):
            found.append(part)
        else:
            found.extend(part)
    return found


def unflatten(episode: Episode, arrays: Iterable[Array]) -> Episode:
    """Return an episode with the same structure but other arrays."""
    rest = iter(arrays)
    parts: Iterable[Any] = (
        next(rest) if isinstance(part, np.ndarray) else type(part)(*islice(rest, len(part))) for part in episode
    )
    return Episode(*parts)


def pool_of_one(episode: Episode) -> Episode:
    """Return a pool with one episode, as views of its arrays."""
    return _each(episode, lambda raster: raster.reshape(1, -1), lambda array: array[None])


def one_of(pool: Episode, i: int, shape: tuple[int, int]) -> Episode:
    """Return episode ``i`` of a pool as views of the pool's arrays; ``shape`` is that of the house's rasters."""
    cells = shape[0] * shape[1]
    return _each(pool, lambda raster: raster[i, :cells].reshape(shape), lambda array: array[i])


def _each(episode: Episode, of_raster: Callable[[Array], Array], of_other: Callable[[Array], Array]) -> Episode:
    """Return an episode with the functions applied to each array."""
    parts: tuple[Any, ...] = episode
    rasters: Iterable[Any] = map(of_raster, parts[:RASTERS])
    others = (
        of_other(part) if isinstance(part, np.ndarray) else type(part)(*map(of_other, part)) for part in parts[RASTERS:]
    )
    return Episode(*rasters, *others)
