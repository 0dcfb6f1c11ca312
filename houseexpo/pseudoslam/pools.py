"""Nested tuples of arrays, such as ``kernels.step.Episode``, alone and in pools with one axis more in front."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.kernels.step import Episode

Array = npt.NDArray[Any]

RASTERS = 3
"""The first arrays of an episode are as big as its house; they lie flat in a pool."""


def leaves(part: Any) -> Iterator[Array]:
    """Yield the arrays in nested tuples, one after the other."""
    if isinstance(part, np.ndarray):
        yield part
    else:
        for piece in part:
            yield from leaves(piece)


def like(part: Any, arrays: Iterable[Array]) -> Any:
    """Return the same nested tuples, of other arrays."""
    return _like(part, iter(arrays))


def pool_of_one(episode: Episode) -> Episode:
    """Return a pool that holds one episode: views of its arrays."""
    parts = (leaf.ravel() if k < RASTERS else leaf for k, leaf in enumerate(leaves(episode)))
    pool: Episode = like(episode, (part[None] for part in parts))
    return pool


def one_of(pool: Episode, i: int, shape: tuple[int, int]) -> Episode:
    """Return episode ``i`` of a pool, of a house whose rasters have this shape: views of the pool's arrays."""
    cells = shape[0] * shape[1]
    parts = (leaf[i, :cells].reshape(shape) if k < RASTERS else leaf[i] for k, leaf in enumerate(leaves(pool)))
    episode: Episode = like(pool, parts)
    return episode


def _like(part: Any, arrays: Iterator[Array]) -> Any:
    if isinstance(part, np.ndarray):
        return next(arrays)
    return type(part)(*(_like(piece, arrays) for piece in part))
