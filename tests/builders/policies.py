"""Policies that tests know, and a track in a corridor. Processes find them by ``tests.builders.policies:name``."""

from __future__ import annotations

import os
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
from numba.core.event import end_event, start_event

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.loading import NamedPolicy
from houseexpo.pseudoslam.agents.protocol import Interface, Knowledge, Policy, PolicyFactory, Robot
from houseexpo.pseudoslam.benchmark import measures
from houseexpo.pseudoslam.benchmark.tracks import Track
from houseexpo.pseudoslam.config import LaserConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.kernels.step import step_pool_by_sector

CORRIDOR = FloorPlan("corridor", [(0, 0), (0, 1), (13, 1), (13, 0)], 1, {})
"""13 x 1 m: a robot that sees 1 m all round and goes along it sees 0.3 m2 more with each step."""
BUDGETS = (10, 20)
ALONG = SimulatorConfig(
    pixels_per_metre=20.0,
    laser=LaserConfig(range_m=1.0, fov_deg=360.0),
    start=StartConfig(random=False, x_m=1.5, y_m=0.5),
    max_steps=40,
)
TINY = Track(
    "tiny", "tiny-v1", "Go along a corridor.", ALONG, "exploration", {"success_coverage": 1.0},
    measures.budget_metrics(BUDGETS), measures.CoverageAtBudgets(BUDGETS), (("steps", 40), ("metres", 8)),
)  # fmt: skip


def named(factory: PolicyFactory, name: str = "mine") -> NamedPolicy:
    return NamedPolicy(name, factory, "a test", "")


def always(action: Any) -> PolicyFactory:
    """Policies that take the same action again and again."""
    return lambda _robot, _seed: lambda _observation, _info: action


def forward(_: Robot, __: int) -> Policy:
    return lambda _observation, _info: 0


def at_step(step: int, what: Any) -> PolicyFactory:
    """Policies that go forward, and return something else, or call it, from a step on."""

    def policy(_: Any, info: Knowledge) -> Any:
        if info["steps"] < step:
            return 0
        return what() if callable(what) else what

    return lambda _robot, _seed: policy


def compiles(_: Robot, __: int) -> Policy:
    """Takes 4 s at step 2, for a kernel is compiled."""

    def policy(_: Any, info: Knowledge) -> int:
        if info["steps"] == 2:
            said = {"dispatcher": SimpleNamespace(py_func=step_pool_by_sector.py_func)}
            start_event("numba:compile", said)
            time.sleep(4)
            end_event("numba:compile", said)
        return 0

    return policy


def dies(_: Robot, __: int) -> Policy:
    """Ends its process at step 3."""
    return at_step(3, lambda: os._exit(7))(_, __)


def sleeps(_: Robot, __: int) -> Policy:
    """Never answers at step 2."""
    return at_step(2, lambda: time.sleep(600))(_, __)


def raises(_: Robot, __: int) -> Policy:
    """Raises at step 1."""
    return at_step(1, lambda: {}["no such key"])(_, __)


def not_a_number(_: Robot, __: int) -> Policy:
    """Returns NaN at step 4."""
    return at_step(4, float("nan"))(_, __)


class Continuous:
    """Goes half a step and turns a little, by shares of both."""

    interface = Interface(actions="continuous", observation="dict")

    def __init__(self, robot: Robot, _: int) -> None:
        assert robot.world is None

    def __call__(self, observation: Any, _: Knowledge) -> Any:
        assert set(observation) == {"map", "global_map", "pose", "ranges"}
        return np.array([0.5, 0.1], np.float32)
