"""What actions mean in the form that kernels take, and which of them go forward, without compiling a step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from houseexpo.pseudoslam.config import Ackermann, Differential, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.spec import Actions, EnvSpec
from houseexpo.pseudoslam.tasks import Exploration

SHARES = [(1.0, 0.0), (0.25, -1.0), (1e-9, 0.5), (0.0, 1.0), (0.0, 0.0), (-1e-9, 0.0), (-1.0, 0.5)]
FORWARD = [True, True, True, False, False, False, False]
DRIVES = [None, Differential(max_speed_m_s=0.5, max_turn_deg_s=90.0), Ackermann(max_speed_m_s=0.5)]


def spec_of(robot: RobotConfig, actions: Actions) -> EnvSpec:
    choice: Any = None  # of plans, which actions do not need
    return EnvSpec(Exploration(), SimulatorConfig(20.0, robot=robot), choice, actions, "map")


@pytest.mark.parametrize("drive", DRIVES, ids=["exact", "differential", "ackermann"])
def test_a_share_above_zero_goes_forward_and_no_other(drive: Differential | Ackermann | None) -> None:
    spec = spec_of(RobotConfig(0.2, drive=drive), "continuous")
    _, ahead = spec.motions(np.array(SHARES), len(SHARES))
    assert ahead.tolist() == FORWARD
    assert [spec.motions(np.array(action))[1].tolist() for action in SHARES] == [[each] for each in FORWARD]
