"""The explorer that looks round: it takes no step before it has seen what it can see from where it is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.learned import FrontierChooser, LookAround, look_around
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import Robot, make_knowledge
from houseexpo.pseudoslam.config import LaserConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.frontier_features import FEATURES
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.learning.weights import read_weights
from houseexpo.pseudoslam.simulator import ACTIONS, Simulator
from houseexpo.pseudoslam.worlds.world import new_scan_buffers

CONFIG = SimulatorConfig(pixels_per_metre=12.5)
RANGE_PX = CONFIG.laser.range_m * CONFIG.pixels_per_metre
RIGHT_ROOM = [(4.2, 3.5), (4.2, 6), (9, 6), (9, 0), (4.2, 0), (4.2, 2.5)]
HALL = FloorPlan("hall", [(0, 0), (0, 6), (4, 6), (4, 3.5), *RIGHT_ROOM, (4, 2.5), (4, 0)], 1, {})
"""Two rooms and a door between them: who comes in does not see the walls beside the door."""
WEIGHTS = read_weights(look_around.file)[0]


def walk(explorer: FrontierChooser, config: SimulatorConfig, seed: int) -> tuple[list[int], list[np.ndarray], float]:
    """Return the actions, the maps before them, and the coverage in the end."""
    simulator = Simulator.of(HALL, config)
    state = simulator.start(np.random.default_rng(seed))
    actions, maps = list[int](), list[np.ndarray]()
    while len(actions) < 1500:
        info = make_knowledge(simulator, state)
        action = explorer(None, info)
        if action is None:
            break
        maps.append(np.concatenate([info["pose_px"], info["map"].ravel()]))
        actions.append(action)
        simulator.step(state, ACTIONS[action])
    return actions, maps, simulator.coverage(state)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_before_a_step_it_has_swept_all_that_is_unknown_in_sight(seed: int) -> None:
    actions, maps, coverage = walk(LookAround(Robot(CONFIG), 0, WEIGHTS), CONFIG, seed)
    assert coverage > 0.99
    swept, looked = list[float](), 0
    runs, hit, slopes = new_scan_buffers(RANGE_PX)
    shape = Simulator.of(HALL, CONFIG).world.occupied.shape
    before: int | None = None
    for action, seen in zip(actions, maps, strict=True):
        if before == 0:
            swept.clear()
        x, y, heading = seen[:3]
        swept.append(heading)
        if action == 0 and before is not None and before != 0:  # a turn is over
            looked += 1
            known = seen[3:].reshape(shape)
            _, n = sector_scan((known != FREE).astype(np.uint8), x, y, 0.0, math.pi, RANGE_PX, runs, hit, slopes)
            rows, cols = np.divmod(np.unique(hit[:n]), shape[1])
            unknown = np.arctan2(y - rows - 0.5, cols + 0.5 - x)[known[rows, cols] == UNKNOWN].tolist()
            missed = [a for a in unknown if all(math.cos(a - h) < -1e-6 for h in swept)]
            assert len(missed) < 2  # less than 0.12 m
        before = action
    assert looked > 3


def test_a_robot_that_sees_all_round_goes_as_the_chooser_does() -> None:
    config = replace(CONFIG, laser=LaserConfig(fov_deg=360.0))
    straight = WEIGHTS.copy()
    straight[FEATURES.index("turn")] = 0.0  # the heading of its choices is that at which it came
    one, other = (walk(kind(Robot(config), 0, straight), config, 0) for kind in (LookAround, FrontierChooser))
    assert one[0] == other[0]
    assert one[2] > 0.99


def test_weights_come_with_what_made_them() -> None:
    policy = load_policy("look-around")
    assert (policy.training.family, policy.training.seed) == ("look-around", 0)  # type: ignore[union-attr]
    assert policy.sha256 != load_policy("finisher").sha256
