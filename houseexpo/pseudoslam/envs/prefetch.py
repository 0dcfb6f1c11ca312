"""The episodes that environments begin next, which may be made ready while others are stepped."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.utils import seeding

from houseexpo.errors import ConfigError, PlanError
from houseexpo.pseudoslam.envs.spec import EnvSpec, constants_of
from houseexpo.pseudoslam.kernels.episode import StepParams
from houseexpo.pseudoslam.kernels.types import Scratch
from houseexpo.pseudoslam.pools import flatten
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.cache import OF_A_CELL
from houseexpo.pseudoslam.worlds.world import World

_MAX_READY_BYTES = 200_000_000
"""Bytes of episodes that wait, and of their worlds: some 400 in houses of 120 m2 at 16 px/m."""


class InitialEpisode(NamedTuple):
    """An episode that begins: its rasters may be the world's."""

    world: World
    state: State
    constants: tuple[float, ...]
    """A row of ``measures.EpisodeConstants``."""


@dataclass(frozen=True, eq=False)
class _Ready:
    """A start that waits, its bytes, and its generator's state before it was drawn."""

    start: InitialEpisode
    size: int
    before: Any


class EpisodePrefetcher:
    """The generators of N environments, and the episodes that are drawn from them.

    With ``ahead``, ``prepare`` draws what is to come. That changes nothing but when it is drawn: where something else
    is asked for after all, the generator goes back.
    """

    def __init__(self, env_spec: EnvSpec, params: StepParams, scratch: Scratch, *, ahead: bool) -> None:
        self._env_spec, self._params, self._scratch, self._ahead = env_spec, params, scratch, ahead
        self._rngs: dict[int, np.random.Generator] = {}
        self._ready: dict[int, _Ready] = {}
        self._lacking: dict[int, None] = {}  # numbers, in the order that they began in: so they end, mostly
        self._size = 0

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and copy without what is ready: the copy draws it again, from generators as they were before it."""
        rngs = deepcopy(self._rngs)
        for i, ready in self._ready.items():
            rngs[i].bit_generator.state = ready.before
        lacking = dict.fromkeys((*self._ready, *self._lacking))
        return {**self.__dict__, "_rngs": rngs, "_ready": {}, "_lacking": lacking, "_size": 0}

    @property
    def lack(self) -> bool:
        """Whether there is an episode to be made ready, and room for it."""
        return bool(self._lacking) and self._size < _MAX_READY_BYTES

    def seed(self, i: int, seed: int | None) -> None:
        """Give environment ``i`` a generator; without a seed, only if it has none."""
        if seed is not None or i not in self._rngs:
            self._taken(i)
            self._rngs[i] = seeding.np_random(seed)[0]

    def next(self, i: int, plan_id: str | None) -> InitialEpisode:
        """Return the next episode of environment ``i``, in a plan or in a random one.

        Raises
        ------
        ConfigError, PlanError
            As ``WorldCache`` and ``beginning.initial_state`` raise them.
        ResetNeeded
            Where it has no generator yet.
        """
        rng, ready = self._rngs.get(i), self._taken(i)
        if rng is None:
            raise gymnasium.error.ResetNeeded(f"environment {i}: call reset() before anything else")
        if self._ahead:
            self._lacking.pop(i, None)
            self._lacking[i] = None
        if ready is not None:
            if plan_id is None:
                return ready.start
            rng.bit_generator.state = ready.before
        return self._drawn(rng, plan_id)

    def prepare(self) -> bool:
        """Make an episode ready that is not; return whether there is another one to make.

        A world that cannot give what is asked is left to ``next``, which fails, too.
        """
        i = next(iter(self._lacking))
        del self._lacking[i]
        rng = self._rngs[i]
        before = rng.bit_generator.state
        try:
            start = self._drawn(rng, None)
            size = OF_A_CELL * start.world.occupied.nbytes + sum(leaf.nbytes for leaf in flatten(start.state.episode))
            self._size += size
            self._ready[i] = _Ready(start, size, before)
        except BaseException as error:
            self._taken(i)
            rng.bit_generator.state = before
            if not isinstance(error, (ConfigError, PlanError)):
                raise  # a Ctrl-C may come out of compiled code as a SystemError
        return self.lack

    def _taken(self, i: int) -> _Ready | None:
        """Return what was ready, and is no longer."""
        ready = self._ready.pop(i, None)
        if ready is not None:
            self._size -= ready.size
        return ready

    def _drawn(self, rng: np.random.Generator, plan_id: str | None) -> InitialEpisode:
        world = self._env_spec.draw(rng, plan_id)
        state = self._env_spec.initial_state(world, self._params, self._scratch, rng, own=False)
        return InitialEpisode(world, state, constants_of(state, world))
