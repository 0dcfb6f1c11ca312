"""Hold many episodes in common arrays, and step them all by compiled calls on threads, for vector environments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.error import ClosedEnvironmentError
from numba.core import config as config_of_numba

from houseexpo.processes import count_cores
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.bound_pool import BoundPool, PoolBinding
from houseexpo.pseudoslam.kernels.compiling import compiled_function
from houseexpo.pseudoslam.kernels.episode import Episode, StepParams
from houseexpo.pseudoslam.state import (
    MAP,
    RASTERS,
    SHOWN,
    Array,
    State,
    flatten_episode,
    unflatten_episode,
    view_episode,
)
from houseexpo.pseudoslam.step_kernels import choose_kernel, enlarge_scratch, make_scratch

_SPARE = 1.25  # spare room for larger houses
_BLOCKS = 4  # per thread, so that threads finish at about the same time
_NOTHING = np.empty(0, np.uint8)


class EpisodeBatch:
    """N episodes in pools: each array of ``Episode`` with an additional first axis.

    Rasters and distances to goals are flat, with room for the largest house so far; untouched memory is not allocated.
    Threads share the pools and have their own working memory; the result does not depend on the number of threads.
    ``moves`` is an argument of ``choose_kernel``.
    """

    def __init__(
        self,
        number: int,
        config: SimulatorConfig,
        params: StepParams,
        threads: int | None = None,
        *,
        moves: bool | None = None,
    ) -> None:
        off = config_of_numba.DISABLE_JIT  # type: ignore[attr-defined]  # what is not compiled is for one thread
        self.threads = 1 if off else min(threads or count_cores(), number)
        self.sizes = np.zeros((number, 2), np.int64)
        self.arrays: Episode
        """The pool; ``shown`` is the array that the views were drawn into last."""
        self._number, self._config, self._params, self._is_closed = number, config, params, False
        self._moves = moves
        self._leaves: list[Array] = []
        self._shown: Array | None = None
        self._rest: dict[int, tuple[Any, ...]] = {}
        self._houses: dict[int, tuple[Array, ...]] = {}  # the rasters of the worlds in places where nothing moves
        self._step: Callable[..., None]
        self._kernels: dict[bool, Callable[..., None]] = {}
        self._scratch = [make_scratch(config) for _ in range(self.threads)]
        self._bindings = [PoolBinding() for _ in range(self.threads)]
        self._executor = ThreadPoolExecutor(self.threads - 1, "pseudoslam") if self.threads > 1 else None
        parts = min(_BLOCKS * self.threads, number) if self._executor else 1
        self._blocks = list(pairwise((np.arange(parts + 1) * number // parts).tolist()))

    def __reduce__(self) -> tuple[Callable[..., EpisodeBatch], tuple[Any, ...]]:
        """Pickle and copy the episodes; the copy has its own pools and threads."""
        states = {i: self.state(i) for i in self._rest}
        return _batch_of, (self._number, self._config, self._params, self.threads, self._moves, states)

    def put(self, i: int, state: State) -> None:
        """Copy an episode to place ``i``; the state that was there is no longer valid.

        Its view is not drawn yet, since the array of the last views may belong to the caller.
        """
        parts = flatten_episode(state.episode)
        houses = self._houses.get(i, ()), tuple(parts[:MAP])
        parts[:RASTERS] = [raster.ravel() for raster in parts[:RASTERS]]
        cells = state.episode.occupied.size if len(state.episode.plans.state) else 0
        if cells > len(self._scratch[0].ways.ways):
            self._scratch = [enlarge_scratch(scratch, int(_SPARE * cells)) for scratch in self._scratch]
        if not self._leaves:
            self._begin(state, parts)
        if any(len(part) > pool.shape[1] for part, pool in zip(parts, self._leaves, strict=True)):
            self._leaves = [_wider(pool, len(part)) for part, pool in zip(parts, self._leaves, strict=True)]
            self.arrays = unflatten_episode(state.episode, self._leaves)._replace(shown=self.arrays.shown)
        if not state.counts.known:
            self._clear_map(i)
            parts[MAP] = _NOTHING
        if _are_kept(state.episode):
            for k, (old, new) in enumerate(zip(*houses, strict=False)):
                if old is new:
                    parts[k] = _NOTHING  # the house's cells are there already
            self._houses[i] = houses[1]
        else:
            self._houses.pop(i, None)
        parts[SHOWN] = _NOTHING
        for part, pool in zip(parts, self._leaves, strict=True):
            if part.size:  # half of them are empty
                pool[i, : len(part)] = part
        self.sizes[i] = state.episode.occupied.shape
        self._rest[i] = (
            state.observable_cells, state.obstacles, state.goal_m, state.shortest_path_m, state.goal_number,
        )  # fmt: skip

    def _clear_map(self, i: int) -> None:
        """Make the map at place ``i`` unknown, where the scans of the episode there have drawn."""
        counts = self.arrays.counts[i, 0]
        scanned = slice(None) if self.arrays.fresh.shape[1] else slice(counts.low, counts.high)  # teams exchange maps
        self._leaves[MAP][i, scanned] = 0

    def _begin(self, first: State, parts: list[Array]) -> None:
        """Make the pools, and find the kernel for steps of such episodes."""
        leaves: list[Array] = [np.zeros((self._number, *part.shape), part.dtype) for part in parts]
        self.arrays = unflatten_episode(first.episode, leaves)
        if self._shown is not None:
            self.arrays = self.arrays._replace(shown=self._shown)
        motions, wanted = np.zeros((0, 2)), np.zeros(0, np.uint8)
        self._step = compiled_function(
            choose_kernel(first.episode, self._params, moves=self._moves),
            self._bound(0), motions, wanted, 0, 0,
        )  # fmt: skip
        self._leaves = leaves  # last, since compiling the kernel may be interrupted

    def kernel(self, *, moves: bool) -> Callable[..., None]:
        """Return the compiled steps of such episodes; ``moves`` is an argument of ``choose_kernel``."""
        if moves not in self._kernels:  # numba needs 20 us to find one
            motions, wanted = np.zeros((0, 2)), np.zeros(0, np.uint8)
            first = self.state(next(iter(self._rest))).episode
            self._kernels[moves] = compiled_function(
                choose_kernel(first, self._params, moves=moves),
                self._bound(0), motions, wanted, 0, 0,
            )  # fmt: skip
        return self._kernels[moves]

    def renew_views(self, *, copy: bool = False) -> None:
        """Have the next steps draw their views into a new array; unless it is a ``copy``, it has no views yet."""
        shown = self.arrays.shown
        self.arrays = self.arrays._replace(shown=shown.copy() if copy else np.empty_like(shown))

    def draw_into(self, views: Array) -> None:
        """Draw all views into an array (N, side, side) of the caller, as long as none has to be ``fresh``."""
        self._shown = views
        if self._leaves:
            self.arrays = self.arrays._replace(shown=views)

    def state(self, i: int) -> State:
        """Return the episode at place ``i``; its arrays are views, which the next step changes."""
        rows, cols = self.sizes[i].tolist()
        return State(view_episode(self.arrays, i, (rows, cols)), *self._rest[i])

    def step(self, motions: npt.NDArray[np.float64], wanted: npt.NDArray[np.uint8], *, fresh: bool = False) -> None:
        """Do what is ``wanted`` (N,) (see ``kernels.step``); ``motions`` (N, 2) are in radians and pixels.

        With ``fresh``, views are drawn into a new array, without those of environments that are left out.
        """
        if fresh:
            self.renew_views()
        run = self._step
        self.share_bound(lambda bound, first, end: run(bound, motions, wanted, first, end))

    def share(self, work: Callable[[int, int], None]) -> None:
        """Call ``work`` on all threads for ranges of environments: from a first number up to but excluding a second."""
        self._share([None] * self.threads, lambda _, first, end: work(first, end))

    def share_bound(self, work: Callable[[BoundPool, int, int], None]) -> None:
        """Do the same for work that also takes the pool, bound with a thread's working memory."""
        self._share([self._bound(thread) for thread in range(self.threads)], work)

    def _bound(self, thread: int) -> BoundPool:
        return self._bindings[thread].bind(self.arrays, self.sizes, self._params, self._scratch[thread])

    def _share(self, each: list[Any], work: Callable[[Any, int, int], None]) -> None:
        """Call ``work`` on all threads, with what each has of its own."""
        if self._is_closed:
            raise ClosedEnvironmentError("the environments were closed: make new ones")
        blocks, running = iter(self._blocks), []  # all threads take the next block from here
        if self._executor:
            running = [self._executor.submit(_run, work, own, blocks) for own in each[1:]]
        try:
            _run(work, each[0], blocks)
        finally:
            for other in running:
                if not other.cancel():  # in a forked process, none of them starts
                    other.result()

    def close(self) -> None:
        """End the threads; further steps are refused."""
        self._is_closed = True
        if self._executor:
            self._executor.shutdown()


def _run(work: Callable[[Any, int, int], None], own: Any, blocks: Iterator[tuple[int, int]]) -> None:
    """Do the work for blocks of environments until there are no more."""
    for first, end in blocks:
        work(own, first, end)


def _batch_of(  # noqa: PLR0917  # what a batch is made of
    number: int, config: SimulatorConfig, params: StepParams, threads: int, moves: bool | None, states: dict[int, State]
) -> EpisodeBatch:
    """Return a batch with these episodes in their places, and the last view of each."""
    batch = EpisodeBatch(number, config, params, threads, moves=moves)
    for i, state in states.items():
        batch.put(i, state)
    for i, state in states.items():
        batch.state(i).view[...] = state.view
    return batch


def _are_kept(episode: Episode) -> bool:
    """Return whether steps do not change the house's cells, and these are the world's, which nobody else changes."""
    bodies = episode.bodies
    moves = len(bodies.people) + len(bodies.clocks) > 0 or len(bodies.robots) > 1
    return not (moves or episode.occupied.flags.writeable or episode.observable.flags.writeable)


def _wider(pool: Array, length: int) -> Array:
    """Return a pool with room for ``length`` values, possibly the same one."""
    if length <= pool.shape[1]:
        return pool
    wider = np.zeros((len(pool), int(_SPARE * length), *pool.shape[2:]), pool.dtype)
    wider[:, : pool.shape[1]] = pool
    return wider
