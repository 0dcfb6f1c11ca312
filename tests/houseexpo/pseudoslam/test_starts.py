"""Episodes made ready ahead of time are those that would be drawn when they are asked for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.envs import prefetch as starts
from houseexpo.pseudoslam.envs.prefetch import EpisodePrefetcher, InitialEpisode
from houseexpo.pseudoslam.envs.spec import EnvSpec, make_env_spec
from houseexpo.pseudoslam.pools import flatten
from houseexpo.pseudoslam.tasks import Exploration
from tests.builders.vectors import HUTS, assert_same_step, native, singles

SMALL = SimulatorConfig(
    pixels_per_metre=16.0,
    observation=ObservationConfig(3.0),
    max_steps=9,
    obstacles=ObstaclesConfig(random=RandomObstacles((0, 3), (0.1, 0.4))),
)


@pytest.fixture(scope="module")
def env_spec() -> EnvSpec:
    return make_env_spec(Exploration(success_coverage=None), HUTS, SMALL, "discrete", "map", pooled=True)


def starts_of(env_spec: EnvSpec, *, ahead: bool) -> EpisodePrefetcher:
    found = EpisodePrefetcher(env_spec, env_spec.params(), env_spec.scratch(), ahead=ahead)
    for i in range(2):
        found.seed(i, 5 + i)
    return found


def bytes_of(start: InitialEpisode) -> tuple[Any, ...]:
    arrays = tuple(leaf.tobytes() for leaf in flatten(start.state.episode))
    return start.world.plan_id, repr(start.constants), start.state.obstacles, arrays


def test_what_is_made_ready_is_what_would_be_drawn(env_spec: EnvSpec) -> None:
    plain, early = starts_of(env_spec, ahead=False), starts_of(env_spec, ahead=True)
    what: list[tuple[int, str | None]] = [(0, None), (1, None), (0, None), (0, "large"), (1, None), (0, None)]
    for k, (i, plan_id) in enumerate(what):
        assert bytes_of(early.next(i, plan_id)) == bytes_of(plain.next(i, plan_id)), k
        assert not plain.lack
        while k != 3 and early.lack:
            early.prepare()
    for found in (plain, early):
        found.seed(0, 99)
        found.seed(1, None)
    for i in (0, 1):
        assert bytes_of(early.next(i, None)) == bytes_of(plain.next(i, None))


@pytest.mark.parametrize("error", [ConfigError("no place"), KeyboardInterrupt(), SystemError("interrupted")])
def test_what_fails_ahead_fails_when_it_is_asked_for(
    env_spec: EnvSpec, error: BaseException, monkeypatch: pytest.MonkeyPatch
) -> None:
    draw: Callable[..., InitialEpisode] = EpisodePrefetcher._drawn

    def fails_half_of_the_time(
        self: EpisodePrefetcher, rng: np.random.Generator, plan_id: str | None
    ) -> InitialEpisode:
        if rng.random() < 0.5:
            raise error
        return draw(self, rng, plan_id)

    monkeypatch.setattr(EpisodePrefetcher, "_drawn", fails_half_of_the_time)
    outcomes, raised = [], 0
    for ahead in (False, True):
        found, outcome = starts_of(env_spec, ahead=ahead), []
        for k in range(40):
            try:
                outcome.append(bytes_of(found.next(k % 2, None)))
            except type(error):
                outcome.append(())
            while found.lack:
                try:
                    found.prepare()
                except (KeyboardInterrupt, SystemError):  # what comes of a Ctrl-C goes up, a start's own trouble waits
                    raised += 1
        outcomes.append(outcome)
    assert outcomes[0] == outcomes[1]
    assert (raised > 0) == (not isinstance(error, ConfigError))
    assert 5 < outcomes[0].count(()) < 35


def test_no_more_are_made_ready_than_there_is_room_for(env_spec: EnvSpec, monkeypatch: pytest.MonkeyPatch) -> None:
    found = starts_of(env_spec, ahead=True)
    for i in (0, 1):
        found.next(i, None)
    monkeypatch.setattr(starts, "_MAX_READY_BYTES", 1)
    assert found.lack
    assert not found.prepare()
    found.next(0, None)  # the one that was ready
    assert found.lack


def test_nothing_starts_without_a_generator(env_spec: EnvSpec) -> None:
    with pytest.raises(gymnasium.error.ResetNeeded, match="environment 1: call reset"):
        EpisodePrefetcher(env_spec, env_spec.params(), env_spec.scratch(), ahead=True).next(1, None)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_reset_gets_what_it_would_without_anything_ready(mode: str) -> None:
    given: dict[str, Any] = {"dataset": HUTS, "config": SMALL, "success_coverage": None}
    many, each = native("Exploration", 4, mode, threads=2, **given), singles("Exploration", 4, mode, **given)
    moves, ready = np.random.default_rng(0), 0
    resets: list[dict[str, Any]] = [
        {"seed": 1},
        {"options": {"plan_id": "large"}},
        {},
        {"seed": [None, 3, None, 4]},
        {"options": {"plan_id": "small"}, "seed": [None, None, 8, 9]},
    ]
    for reset in resets:
        assert_same_step(many.reset(**reset), each.reset(**reset), reset)
        for step in range(23):
            actions = moves.integers(3, size=4)
            assert_same_step(many.step(actions), each.step(actions), (reset, step))
            ready = max(ready, len(many.unwrapped._prefetcher._ready))
    assert ready > 0
    many.close()


def test_who_resets_by_himself_gets_nothing_made_ready() -> None:
    env = native("Exploration", 4, "Disabled", threads=2, dataset=HUTS, config=SMALL)
    env.reset(seed=0)
    for _ in range(5):
        env.step(np.zeros(4, np.int64))
    assert not env.unwrapped._prefetcher._ready
    env.close()
