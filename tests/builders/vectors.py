"""Vector environments beside gymnasium's own of single ones, compared bit by bit."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan


def hut(plan_id: str, side_m: float) -> FloorPlan:
    """A room 1.6 times as wide as it is high."""
    width = 1.6 * side_m
    return FloorPlan(plan_id, [(0, 0), (0, side_m), (width, side_m), (width, 0)], 1, {})


HUTS = [hut("small", 3.0), hut("middle", 4.5), hut("large", 6.0)]


def native(task: str, number: int, mode: str = "NextStep", **given: Any) -> VectorEnv:
    """The project's vector environment."""
    return gymnasium.make_vec(f"PseudoSLAM/{task}-v0", num_envs=number, autoreset_mode=mode, **given)


def singles(task: str, number: int, mode: str = "NextStep", **given: Any) -> VectorEnv:
    """gymnasium's, of single environments."""
    return gymnasium.make_vec(
        f"PseudoSLAM/{task}-v0",
        num_envs=number,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        **given,
    )


def assert_same(one: Any, other: Any, where: str = "") -> None:
    """Nested dictionaries, tuples and arrays are equal, types included."""
    assert type(one) is type(other), (where, type(one), type(other))
    if isinstance(one, dict):
        assert set(one) == set(other), (where, set(one) ^ set(other))
        for key in one:
            assert_same(one[key], other[key], f"{where}/{key}")
    elif isinstance(one, tuple) or (isinstance(one, np.ndarray) and one.dtype == object):
        assert len(one) == len(other), where
        for i, (part, its) in enumerate(zip(one, other, strict=True)):
            assert_same(part, its, f"{where}/{i}")
    elif isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape), (where, one.dtype, other.dtype)
        assert one.tobytes() == other.tobytes(), (where, one, other)
    else:
        assert one == other, (where, one, other)


def assert_same_step(one: tuple[Any, ...], other: tuple[Any, ...], where: object = "") -> None:
    """What ``reset`` or ``step`` returned is equal; infos where their masks say that they speak of an environment."""
    assert_same(one[:-1], other[:-1], str(where))
    _assert_same_infos(one[-1], other[-1], f"{where}, info")


def _assert_same_infos(one: dict[str, Any], other: dict[str, Any], where: str = "") -> None:
    """Infos are equal where their masks say that they speak of an environment; masks are equal."""
    assert set(one) == set(other), (where, set(one) ^ set(other))
    for key, value in one.items():
        if key.startswith("_") or f"_{key}" not in one:
            assert_same(value, other[key], f"{where}/{key}")
        elif isinstance(value, dict):
            _assert_same_infos(value, other[key], f"{where}/{key}")
        else:
            mask = one[f"_{key}"]
            assert_same(value[mask], other[key][mask], f"{where}/{key}")
