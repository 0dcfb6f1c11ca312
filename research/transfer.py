"""What explorations on other maps share: the explorer, what came of it, a scan on a map, and PseudoSLAM's own map."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot, make_knowledge
from houseexpo.pseudoslam.config import LaserConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.pictures import near_pixel_width, picture_side_px
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN, draw_coarse_view
from houseexpo.pseudoslam.simulator import ACTIONS, Simulator
from tests.builders.real_slam import CELL_M

RANGE_M, _SHORT_M = 5.0, 0.02
CONFIG = SimulatorConfig(1 / CELL_M, laser=LaserConfig(range_m=RANGE_M))


@dataclass
class Exploration:
    """What came of an exploration.

    ``coverage`` after each step, of what can be seen; ``off_m``, how far off the robot's belief of its place is at the
    end.
    """

    coverage: list[float] = field(default_factory=list)
    metres: float = 0.0
    collisions: int = 0
    off_m: float = 0.0


class Explorer:
    """A policy of the benchmark where no environment shows it anything: it is shown views of its map if it learned so.

    A view is drawn by the rules of the environments (``draw_coarse_view``), whoever has drawn the map.
    """

    def __init__(self, policy: str, seed: int) -> None:
        named = load_policy(policy)
        view = named.interface.view
        self._shown = replace(CONFIG, observation=view) if view else None
        self._acts = named.factory(Robot(CONFIG), seed)

    def __call__(self, info: Knowledge) -> int | None:
        """Return which of ``ACTIONS`` to take, None where it is done."""
        action = self._acts(self.view_of(info), info)
        return None if action is None else int(action)

    def view_of(self, info: Knowledge) -> npt.NDArray[np.uint8] | None:
        """Return the square of the map round the robot, heading up, (1, side, side); None where none is wanted."""
        if self._shown is None:
            return None
        out = np.zeros((picture_side_px(self._shown), picture_side_px(self._shown)), np.uint8)
        x, y, heading = info["pose_px"].tolist()
        draw_coarse_view(info["map"], x, y, math.cos(heading), math.sin(heading), near_pixel_width(self._shown), out)
        return out[None]


def explore_on_own_map(plan: FloorPlan, policy: str, most: int, seed: int = 0) -> Exploration:
    """Explore on PseudoSLAM's own map, without errors, for at most so many steps."""
    simulator = Simulator.of(plan, CONFIG)
    state = simulator.start(np.random.default_rng(seed))
    acts, found = Explorer(policy, seed), Exploration([simulator.coverage(state)])
    for _ in range(most):
        action = acts(make_knowledge(simulator, state))
        if action is None:
            break
        simulator.step(state, ACTIONS[action])
        found.coverage.append(simulator.coverage(state))
    found.metres = float(state.episode.readings[0].path_length) * CELL_M
    found.collisions = int(state.counts.collisions)
    return found


def add_scan(known: npt.NDArray[np.uint8], pose_px: npt.NDArray[np.float64], ranges_m: npt.ArrayLike) -> None:
    """Draw a scan half round on a map, in place: free along the beams, an obstacle where one ends on something.

    Free cells come first, so that no beam that passes by takes a wall away.

    Parameters
    ----------
    known
        (rows, cols) 0 unknown, 127 free, 255 obstacle.
    pose_px
        (3,) where the robot is: x across, y down, pixels; heading, radians.
    ranges_m
        (n,) from the right to the left; ``RANGE_M`` where nothing is hit.
    """
    x, y, heading = pose_px.tolist()
    metres = np.asarray(ranges_m, np.float64)
    angles = heading + np.linspace(-math.pi / 2, math.pi / 2, len(metres))
    samples = np.arange(0.0, RANGE_M / CELL_M, 0.5)
    passed = samples[None] < np.maximum(metres / CELL_M - 0.5, 0.0)[:, None]
    cols, rows = x + samples * np.cos(angles)[:, None], y - samples * np.sin(angles)[:, None]
    _set(known, rows[passed], cols[passed], FREE, only=UNKNOWN)
    hit = metres < RANGE_M - _SHORT_M
    far = metres[hit] / CELL_M + 0.1
    _set(known, y - far * np.sin(angles[hit]), x + far * np.cos(angles[hit]), OBSTACLE, only=None)


def _set(
    known: npt.NDArray[np.uint8], rows: npt.NDArray[np.float64], cols: npt.NDArray[np.float64], value: int,
    only: int | None,
) -> None:  # fmt: skip
    inside = (rows >= 0) & (rows < known.shape[0]) & (cols >= 0) & (cols < known.shape[1])
    at = np.floor(rows[inside]).astype(int), np.floor(cols[inside]).astype(int)
    if only is not None:
        wanted = known[at] == only
        at = at[0][wanted], at[1][wanted]
    known[at] = value
