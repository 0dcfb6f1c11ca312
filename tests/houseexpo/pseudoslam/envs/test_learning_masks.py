"""sb3-contrib's MaskablePPO chooses among motions, frontiers and neighbours, by the masks of our environments."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.config.simulator import PlanningConfig
from tests.builders.needs import need
from tests.builders.simulations import HUTS, native

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0), max_steps=40)
PLANNING = PlanningConfig(frontiers=4)

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("actions", ["discrete", "frontier"])
def test_a_policy_with_masks_learns(actions: str) -> None:
    need(modules=["torch", "stable_baselines3", "sb3_contrib"], how="make learn")
    import torch
    from sb3_contrib import MaskablePPO
    from sb3_contrib.common.maskable.utils import get_action_masks, is_masking_supported
    from stable_baselines3.common.vec_env import VecMonitor

    from houseexpo.pseudoslam.sb3 import SB3VecEnv

    torch.set_num_threads(1)
    given = {"dataset": HUTS, "config": SMALL, "actions": actions}
    given |= {"action_mask": True} if actions == "discrete" else {"planning": PLANNING}
    env = VecMonitor(SB3VecEnv(native("Exploration", 2, "SameStep", **given)))
    assert is_masking_supported(env)
    model = MaskablePPO("MultiInputPolicy", env, n_steps=16, batch_size=16, n_epochs=1, seed=0)
    model.learn(2 * 16 * 2)
    shown = env.reset()
    for _ in range(10):
        masks = get_action_masks(env)
        assert np.array_equal(masks, shown["action_mask"].astype(bool))
        chosen, _ = model.predict(shown, action_masks=masks)
        assert masks[np.arange(2), chosen].all()
        shown, _, _, _ = env.step(chosen)
    alone = gymnasium.make("PseudoSLAM/Exploration-v0", **given)
    alone.reset(seed=0)
    assert is_masking_supported(alone.unwrapped)
    assert get_action_masks(alone.unwrapped).shape == (3 if actions == "discrete" else 4,)
