"""What a vector environment promises beside being equal: copies, one compiled call, spaces, infos, clear errors."""

from __future__ import annotations

import gc
import multiprocessing
import sys
import warnings
from dataclasses import replace
from types import FrameType
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from houseexpo.pseudoslam.envs import episode_batch
from houseexpo.pseudoslam.envs.vector import PseudoSlamVectorEnv
from houseexpo.pseudoslam.step_kernels import choose_kernel
from tests.builders.simulations import GIVEN, SMALL, assert_same, assert_same_step, explorers, native

KEYS = {"explored_m2", "coverage", "collisions", "collided", "pose", "is_success", "plan_id"}
MORE = {"Exploration": set(), "ObstacleAvoidance": {"clearance_m"}, "Navigation": {"to_goal_m", "way_m", "goal", "spl"}}


def test_copies_are_the_callers_for_as_long_as_he_holds_them() -> None:
    env = explorers(3, observation="dict")
    env.reset(seed=0)
    held = []
    for step in range(40):
        parts = env.step(np.full(3, step % 2))[0]
        held.append((parts["map"] if step % 3 else parts["map"][1, 0], parts["ranges"]))  # a view holds its array
        if step % 5 == 0:
            held[0] = held[-1]  # some are let go
        if step == 0:
            kept = [tuple(part.tobytes() for part in one) for one in held]
        else:
            kept.append(tuple(part.tobytes() for part in held[-1]))
            kept[0] = tuple(part.tobytes() for part in held[0])
        assert [tuple(part.tobytes() for part in one) for one in held] == kept


def test_a_reset_of_some_shows_the_others_again_whatever_was_done_with_their_copies() -> None:
    env = explorers(3, observation="dict")
    env.reset(seed=0)
    held = env.step(np.zeros(3, np.int64))[0]
    seen = {key: part.copy() for key, part in held.items()}
    for part in held.values():
        part[:] = 9
    parts, _ = env.reset(seed=5, options={"reset_mask": np.array([True, False, False])})
    assert (parts["map"][0] != seen["map"][0]).any()
    for key, part in parts.items():
        np.testing.assert_array_equal(part[1:], seen[key][1:])
        assert (held[key] == 9).all()


def in_a_fork(env: Any, answers: Any) -> None:
    answers.put([env.step(np.ones(3, np.int64))[0].tobytes() for _ in range(4)])


@pytest.mark.filterwarnings("ignore:.*fork.*")
@pytest.mark.parametrize("threads", [1, 2])
def test_a_forked_process_goes_on_alone_and_writes_copies_of_its_own(threads: int) -> None:
    """The threads of a batch stay behind in the process that was forked."""
    env = explorers(3, threads=threads)
    env.reset(seed=0)
    held, *_ = env.step(np.zeros(3, np.int64))
    before = held.tobytes()
    context = multiprocessing.get_context("fork")
    answers = context.SimpleQueue()
    child = context.Process(target=in_a_fork, args=(env, answers))
    child.start()
    found = answers.get()
    child.join(60)
    assert child.exitcode == 0
    assert held.tobytes() == before
    assert found == [env.step(np.ones(3, np.int64))[0].tobytes() for _ in range(4)]
    env.close()


def test_views_are_the_maps_themselves() -> None:
    env = explorers(3, copy=False, config=replace(SMALL, max_steps=7))
    first, _ = env.reset(seed=0, options={"plan_id": "small"})
    assert np.shares_memory(first, env.unwrapped.state(0).view)
    for _ in range(10):
        again, *_ = env.step(np.ones(3, np.int64))
        assert np.shares_memory(first, again)
    env.reset(seed=1, options={"plan_id": "large"})  # the pools grow, but not what is shown
    assert np.shares_memory(first, env.step(np.ones(3, np.int64))[0])


def calls_in_a_step(env: Any, actions: np.ndarray) -> list[str]:
    """The Python functions and the C functions that a step calls."""
    found = []

    def note(frame: FrameType, event: str, what: Any) -> None:
        if event in {"call", "c_call"}:
            found.append(frame.f_code.co_qualname if event == "call" else getattr(what, "__qualname__", repr(what)))

    gc.disable()  # others have it call functions of their own
    sys.setprofile(note)
    try:
        env.step(actions)
    finally:
        sys.setprofile(None)
        gc.enable()
    return found


@pytest.mark.parametrize("task", ["Exploration", "ObstacleAvoidance", "Navigation"])
def test_a_step_is_one_compiled_call_and_no_more_python_for_more_of_them(
    task: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls, steps = {}, []

    def noted(*given: Any, **named: Any) -> Any:
        kernel = choose_kernel(*given, **named)
        return lambda *arrays: (steps.append(arrays[-2:]), kernel(*arrays))

    monkeypatch.setattr(episode_batch, "choose_kernel", noted)
    for number in (4, 64):
        env = native(task, number, threads=1, **GIVEN, **({"success_coverage": None} if task == "Exploration" else {}))
        env.reset(seed=0)
        actions = np.ones(number, np.int64)
        for _ in range(5):
            env.step(actions)
        calls[number] = calls_in_a_step(env, actions)
        steps.clear()
        env.step(actions)
        assert steps == [(0, number)]
    assert calls[4] == calls[64]
    assert len(calls[4]) < 300


@pytest.mark.parametrize("actions", ["discrete", "continuous"])
@pytest.mark.parametrize("observation", ["map", "dict"])
@pytest.mark.parametrize("task", ["Exploration", "ObstacleAvoidance", "Navigation"])
def test_gymnasium_finds_nothing_wrong(task: str, observation: str, actions: str) -> None:
    given = {**GIVEN, "observation": observation, "actions": actions}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*not within.*|.*render_mode.*")
        check_env(gymnasium.make(f"PseudoSLAM/{task}-v0", **given).unwrapped, skip_render_check=True)
        env = gymnasium.make_vec(f"PseudoSLAM/{task}-v0", num_envs=3, **given)  # the native one is the default
    assert isinstance(env.unwrapped, PseudoSlamVectorEnv)
    assert env.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    parts, info = env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(3):
        assert parts in env.observation_space
        assert set(info) == {key for name in KEYS | MORE[task] for key in (name, f"_{name}")}
        parts, rewards, terminated, truncated, info = env.step(env.action_space.sample())
        assert [array.dtype for array in (rewards, terminated, truncated)] == [np.float64, bool, bool]
        assert all(len(value) == 3 for value in info.values())


@pytest.mark.parametrize("kind", ["uint8", "int32", "uint64"])
def test_actions_may_be_whole_numbers_of_any_type(kind: str) -> None:
    one, other = explorers(3), explorers(3)
    for env in (one, other):
        env.reset(seed=0)
    assert_same(one.step(np.array([0, 1, 2], kind)), other.step([0, 1, 2]))


def test_no_array_in_infos_is_part_of_another() -> None:
    env, twin = explorers(3), explorers(3)
    for one in (env, twin):
        one.reset(seed=0)
        *step, infos = one.step(np.zeros(3, np.int64))
    arrays = [*step, *infos.values()]
    for i, array in enumerate(arrays):
        assert not any(np.shares_memory(array, other) for other in arrays[:i])
    for array in arrays:
        array[...] = 1  # what a caller writes there changes nothing
    assert_same_step(twin.step(np.ones(3, np.int64)), env.step(np.ones(3, np.int64)))
