"""Environments of huts in which an action is a travel."""

from __future__ import annotations

from typing import Any

import gymnasium

from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from tests.builders.vectors import HUTS

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0), max_steps=200)


def env_of(actions: str, task: str = "Exploration", **given: Any) -> gymnasium.Env:
    """Return an environment of the huts."""
    given = {"dataset": HUTS, "config": SMALL, **given}
    return gymnasium.make(f"PseudoSLAM/{task}-v0", actions=actions, **given)
