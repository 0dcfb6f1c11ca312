"""Many episodes side by side in memory, stepped by one compiled call for each thread."""

from __future__ import annotations

from collections.abc import Callable
from operator import gt
from typing import Any

import numpy as np
import numpy.typing as npt
from numba.core import config as config_of_numba

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.thread_pool import ThreadPool
from houseexpo.pseudoslam.envs.view_buffers import ViewBuffers
from houseexpo.pseudoslam.kernels.episode import KNOWN, Episode, StepParams
from houseexpo.pseudoslam.pools import MAP, RASTERS, SHOWN, Array, flatten, one_of, unflatten
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_params import kernel_for, scratch_of
from houseexpo.workers import cores

_SPARE = 1.25  # room for the next bigger house
_NOTHING = np.empty(0, np.uint8)


class Batch:
    """N episodes in pools: each array of ``Episode`` with one axis more in front.

    Rasters and the ways to goals lie flat, with room for the biggest house so far; what is not touched takes no memory.
    Threads share the pools and have scratch memory of their own; the outcome does not depend on how many there are.
    """

    def __init__(self, number: int, config: SimulatorConfig, params: StepParams, threads: int | None = None) -> None:
        off = config_of_numba.DISABLE_JIT  # type: ignore[attr-defined]  # what is not compiled is for one thread
        self.threads = 1 if off else min(threads or cores(), number)
        self.sizes = np.zeros((number, 2), np.int64)
        self._number, self._config, self._params = number, config, params
        self._leaves: list[Array] = []
        self._room: list[int] = []
        self._rest: dict[int, tuple[Any, ...]] = {}
        self._motions, self._wanted = np.zeros((number, 2)), np.zeros(number, np.uint8)
        self._threads = ThreadPool(number, [scratch_of(config) for _ in range(self.threads)])
        self._views: ViewBuffers
        self._drawn = self._next = -1
        self._pools: tuple[Episode, ...] = ()
        """The pool with each array that takes views, and last with its own: they differ in nothing else."""
        self.arrays: Episode
        """The pool with the array that the views were drawn into last."""

    def __reduce__(self) -> tuple[Callable[..., Batch], tuple[Any, ...]]:
        """Pickle and copy the episodes: the copy has pools and threads of its own."""
        self._threads.finish()
        states = {i: self.state(i) for i in self._rest}
        return _batch_of, (self._number, self._config, self._params, self.threads, states)

    def put(self, i: int, state: State) -> None:
        """Copy an episode into place ``i``; the state that was there is no longer valid.

        What it is shown is to be drawn yet: the array of the last views may be the caller's.
        """
        self._threads.finish()
        parts = flatten(state.episode)
        parts[:RASTERS] = [raster.ravel() for raster in parts[:RASTERS]]
        if not self._leaves:
            self._leaves = [np.zeros((self._number, *leaf.shape), leaf.dtype) for leaf in parts]
            self._views = ViewBuffers(self._leaves[SHOWN].shape)
        if not self._room:
            self._lay_out(state)
        if any(map(gt, map(len, parts), self._room)):
            self._leaves = [_wider(old, len(leaf)) for leaf, old in zip(parts, self._leaves, strict=True)]
            self._lay_out(state)
        if not state.counts[KNOWN]:
            self._leaves[MAP][i, : len(parts[MAP])] = 0
            parts[MAP] = _NOTHING
        parts[SHOWN] = _NOTHING
        for leaf, pool in zip(parts, self._leaves, strict=True):
            if leaf.size:  # half of them are of what there is not
                pool[i, : len(leaf)] = leaf
        self.sizes[i] = state.episode.occupied.shape
        self._rest[i] = state.observable_cells, state.obstacles, state.goal_m, state.shortest_path_m

    def state(self, i: int) -> State:
        """Return the episode that was put at place ``i``: its arrays are views, which the next step changes."""
        rows, cols = self.sizes[i].tolist()
        return State(one_of(self.arrays, i, (rows, cols)), *self._rest[i])

    def step(
        self,
        motions: npt.NDArray[np.float64],
        wanted: npt.NDArray[Any],
        *,
        fresh: bool = False,
        meanwhile: Callable[[], bool] | None = None,
    ) -> None:
        """Do what is ``wanted`` (N,), see ``kernels.step``: ``motions`` (N, 2) are turn and way, radians and pixels.

        Parameters
        ----------
        fresh
            Draw views into an array that nobody holds: those left are not in it. Otherwise where they were drawn last.
        meanwhile
            Work for the caller's thread, see ``ThreadPool.step``.
        """
        self._threads.finish()
        self._motions[:], self._wanted[:] = motions, wanted
        if fresh:
            self._drawn = self._next if self._next >= 0 else self._views.free()
            self.arrays = self._pools[self._drawn]
        self._threads.step(self._drawn, meanwhile)
        self._next = self._views.free(besides=self._drawn)  # while others draw: it stays free, for nobody gets it

    def views(self) -> Array | None:
        """Return the views (N, side, side), all drawn: the caller's own for as long as he holds them.

        None where none were ever to be ``fresh``, or the caller holds so many that there was no array for the last ones
        that were: then they are in ``arrays.shown``.
        """
        self._threads.finish()
        return self._views.lent[self._drawn] if self._drawn >= 0 else None

    def _lay_out(self, state: State) -> None:
        """Make the pools those of the steps to come."""
        self._room = []  # until it is done: it may be interrupted, for a kernel may have to be compiled
        own = unflatten(state.episode, self._leaves)
        self._pools = (*(own._replace(shown=views) for views in self._views.written), own)
        self.arrays = self._pools[self._drawn]
        kernel = kernel_for(state.episode, self._params, pooled=True)
        self._threads.take_on(kernel, own, self.sizes, self._motions, self._wanted, self._params, self._views.written)
        self._room = [pool.shape[1] for pool in self._leaves]

    def close(self) -> None:
        """End the threads."""
        self._threads.close()


def _batch_of(
    number: int, config: SimulatorConfig, params: StepParams, threads: int, states: dict[int, State]
) -> Batch:
    """Return a batch with these episodes in their places, and what each was shown last."""
    batch = Batch(number, config, params, threads)
    for i, state in states.items():
        batch.put(i, state)
    for i, state in states.items():
        batch.state(i).view[...] = state.view
    return batch


def _wider(pool: Array, length: int) -> Array:
    """Return a pool with room for so many, which may be itself."""
    if length <= pool.shape[1]:
        return pool
    wider = np.zeros((len(pool), int(_SPARE * length), *pool.shape[2:]), pool.dtype)
    wider[:, : pool.shape[1]] = pool
    return wider
