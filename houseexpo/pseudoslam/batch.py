"""Many episodes side by side in memory, stepped by one compiled call for each thread."""

from __future__ import annotations

import itertools
import os
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.step import Episode, Rules
from houseexpo.pseudoslam.pools import RASTERS, Array, leaves, like, one_of
from houseexpo.pseudoslam.rules import kernel_of, scratch_of
from houseexpo.pseudoslam.state import State

_SPARE = 1.25  # room for the next bigger house
_MORE, _MOST = 1.02, 0.9  # how much more the first thread takes where others end later, and the most it takes


class Batch:
    """N episodes in pools: each array of ``Episode`` with one axis more in front.

    Rasters and the ways to goals lie flat, with room for the biggest house so far; what is not touched takes no memory.
    Threads share the pools and have scratch memory of their own; the outcome does not depend on how many there are.
    The first begins at once and the others have to be woken, so it takes more: as much as lets all end together.
    """

    def __init__(self, number: int, config: SimulatorConfig, rules: Rules, threads: int | None = None) -> None:
        threads = min(threads or _cores(), number)
        self.sizes = np.zeros((number, 2), np.int64)
        self._number, self._rules, self._kernel = number, rules, kernel_of(config)
        self._leaves: list[Array] = []
        self._rest: dict[int, tuple[Any, ...]] = {}
        self._scratch = [scratch_of(config) for _ in range(threads)]
        self._lead = 1.0 / threads  # the first thread's share
        self._pool = ThreadPoolExecutor(threads - 1, "pseudoslam") if threads > 1 else None
        self.arrays: Episode

    def put(self, i: int, state: State) -> None:
        """Copy an episode into place ``i``; the state that was there is no longer valid."""
        parts = [leaf.ravel() if k < RASTERS else leaf for k, leaf in enumerate(leaves(state.episode))]
        if not self._leaves:
            self._leaves = [np.zeros((self._number, *leaf.shape), leaf.dtype) for leaf in parts]
        for k, leaf in enumerate(parts):
            old = self._leaves[k]
            if len(leaf) > old.shape[1]:
                self._leaves[k] = np.zeros((self._number, int(_SPARE * len(leaf)), *leaf.shape[1:]), leaf.dtype)
                self._leaves[k][:, : old.shape[1]] = old
            self._leaves[k][i, : len(leaf)] = leaf
        self.arrays = like(state.episode, self._leaves)
        self.sizes[i] = state.episode.solid.shape
        self._rest[i] = state.obstacles, state.goal_m, state.best_way_m

    def state(self, i: int) -> State:
        """Return the episode that was put at place ``i``: its arrays are views, which the next step changes."""
        rows, cols = self.sizes[i].tolist()
        return State(one_of(self.arrays, i, (rows, cols)), *self._rest[i])

    def step(self, motions: npt.NDArray[np.float64], wanted: npt.NDArray[np.uint8]) -> None:
        """Move the robots that are ``wanted`` (N,) by ``motions`` (N, 2), turn and way forward, radians and pixels."""
        if self._pool is None:
            self._run(motions, wanted, 0, (0, self._number))
            return
        bounds = [
            0,
            *np.linspace(round(self._lead * self._number), self._number, len(self._scratch)).astype(int).tolist(),
        ]
        first, *others = itertools.pairwise(bounds)
        jobs = [self._pool.submit(self._run, motions, wanted, k, share) for k, share in enumerate(others, start=1)]
        self._run(motions, wanted, 0, first)
        late = not all(job.done() for job in jobs)
        for job in jobs:
            job.result()
        self._lead = min(max(self._lead * (_MORE if late else 1.0 / _MORE), 1.0 / len(self._scratch)), _MOST)

    def _run(self, motions: Array, wanted: Array, thread: int, share: tuple[int, int]) -> None:
        self._kernel(self.arrays, self.sizes, motions, wanted, self._rules, self._scratch[thread], *share)

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()


def _cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
