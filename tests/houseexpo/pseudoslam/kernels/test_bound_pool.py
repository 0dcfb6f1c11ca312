"""Pools that stay bound, until something in them is another object."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import pytest

from houseexpo import FloorPlan
from houseexpo.pseudoslam import Simulator, SimulatorConfig
from houseexpo.pseudoslam.kernels.bound_pool import PoolBinding
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_kernels import make_scratch, make_step_params

CONFIG = SimulatorConfig(10.0)


@pytest.fixture
def state() -> State:
    plan = FloorPlan("box", [(0, 0), (0, 3), (4, 3), (4, 0)], 1, {})
    return Simulator.of(plan, CONFIG).start(np.random.default_rng(0))


def test_it_is_bound_anew_only_for_other_objects(state: State) -> None:
    binding, params, scratch = PoolBinding(), make_step_params(CONFIG), make_scratch(CONFIG)
    given: tuple[Any, ...] = state.pool, state.sizes, params, scratch
    first = binding.bind(*given)
    assert binding.bind(*given) is first
    others = state.copy().pool, state.sizes.copy(), make_step_params(CONFIG), make_scratch(CONFIG)
    for k, other in enumerate(others):
        bound = binding.bind(*given[:k], other, *given[k + 1 :])
        assert bound is not first
        assert binding.bind(*given[:k], other, *given[k + 1 :]) is bound


def test_a_copy_steps_on_its_own(state: State) -> None:
    simulator = Simulator.of(FloorPlan("box", [(0, 0), (0, 3), (4, 3), (4, 0)], 1, {}), CONFIG)
    simulator.step(state, "left")
    copies = state.copy(), deepcopy(state)
    before = state.poses_px.tolist()
    for each in copies:
        simulator.step(each, "left")
    assert state.poses_px.tolist() == before
    simulator.step(state, "left")
    assert all(each.poses_px.tolist() == state.poses_px.tolist() != before for each in copies)
