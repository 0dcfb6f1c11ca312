"""gymnasium environments over the simulator."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.step import COLLISIONS, STEPS
from houseexpo.pseudoslam.simulator import ACTIONS, Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds import Plans, Worlds

Observation = npt.NDArray[np.uint8]


class ExplorationEnv(gymnasium.Env[Observation, np.int64]):
    """Explore an unknown house: ``PseudoSLAM/Exploration-v0``.

    - *Action*: 0 forward, 1 left, 2 right.
    - *Observation*: (1, side, side) uint8, the map round the robot, heading up: 0 unknown, 127 free, 255 obstacle.
    - *Reward*: newly known area, m2; over an episode it adds up to the area known at the end less the start's.
    - *Terminated* when ``coverage`` reaches ``success_coverage``; *truncated* after ``config.max_steps``.
    - *Info*: ``explored_m2``, ``coverage`` (0 to 1), ``collisions`` so far, ``collided`` in this step, ``pose`` (x, y
      in the plan's metres, heading in radians), ``plan_id``, ``is_success``.

    ``reset(seed=...)`` alone decides plan, start and noise; ``options={"plan_id": ...}`` names the plan.

    Parameters
    ----------
    dataset
        Path of a data set, a data set, a plan or a list of plans; each episode takes one at random.
    config
        What is simulated; the paper's values where it is left out.
    success_coverage
        The share of what the robot can see that ends an episode; None: only the number of steps does.
    render_mode
        "rgb_array", or None.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 10}  # noqa: RUF012  # as gymnasium declares it

    def __init__(
        self,
        dataset: Plans,
        config: SimulatorConfig | None = None,
        *,
        success_coverage: float | None = 0.95,
        render_mode: str | None = None,
    ) -> None:
        if success_coverage is not None and not 0 < success_coverage <= 1:
            raise ConfigError(f"success_coverage: expected more than 0, at most 1, found {success_coverage!r}")
        if render_mode not in {None, *self.metadata["render_modes"]}:
            raise ConfigError(f"render_mode: expected one of {self.metadata['render_modes']}, found {render_mode!r}")
        self.config = config or SimulatorConfig()
        self.render_mode = render_mode
        self.action_space = spaces.Discrete(len(ACTIONS))
        side = self.config.side_px
        self.observation_space = spaces.Box(0, 255, (1, side, side), np.uint8)
        self._success = success_coverage
        self._worlds = Worlds(dataset, self.config)
        self._simulator: Simulator | None = None
        self._state: State | None = None

    @property
    def simulator(self) -> Simulator:
        """The simulator of this episode; ResetNeeded before the first."""
        if self._simulator is None:
            raise gymnasium.error.ResetNeeded("call reset() before anything else")
        return self._simulator

    @property
    def state(self) -> State:
        """The state of this episode, which the next step changes."""
        if self._state is None:
            raise gymnasium.error.ResetNeeded("call reset() before anything else")
        return self._state

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode."""
        super().reset(seed=seed)
        unknown = set(options or {}) - {"plan_id"}
        if unknown:
            raise ConfigError(f"options: unknown key {min(unknown)!r}; known: 'plan_id'")
        if options and "plan_id" in options:
            number = self._worlds.number_of(options["plan_id"])
        else:
            number = int(self.np_random.integers(len(self._worlds)))
        world = self._worlds[number]
        if self._simulator is None:
            self._simulator = Simulator(world, self.config)
        self._simulator.world = world
        self._state = self._simulator.start(self.np_random)
        return self._observation(), self._info()

    def step(self, action: np.int64) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Take one action; ConfigError where there is no such action."""
        if not self.action_space.contains(action):
            raise ConfigError(f"action: expected 0 (forward), 1 (left) or 2 (right), found {action!r}")
        simulator, state = self.simulator, self.state
        before = simulator.explored_m2(state)
        simulator.step(state, ACTIONS[int(action)], self.np_random)
        info = self._info()
        truncated = bool(state.counts[STEPS] >= self.config.max_steps)
        return self._observation(), info["explored_m2"] - before, info["is_success"], truncated, info

    def render(self) -> npt.NDArray[np.uint8] | None:
        """Return the whole map, row 0 at the highest y, with the robot in red, as (rows, cols, 3) uint8."""
        if self.render_mode is None:
            return None
        picture = np.repeat(self.state.known[:, :, None], 3, axis=2)
        rows, cols = np.mgrid[: picture.shape[0], : picture.shape[1]] + 0.5
        x, y, _ = self.state.pose_px
        radius = self.config.robot.radius_m * self.config.pixels_per_metre
        picture[np.hypot(cols - x, rows - y) <= radius] = (220, 50, 47)
        return picture

    def _observation(self) -> Observation:
        return self.state.view[None].copy()

    def _info(self) -> dict[str, Any]:
        simulator, state = self.simulator, self.state
        coverage = simulator.coverage(state)
        return {
            "explored_m2": simulator.explored_m2(state),
            "coverage": coverage,
            "collisions": int(state.counts[COLLISIONS]),
            "collided": state.blocked,
            "pose": np.array(simulator.pose(state)),
            "plan_id": simulator.world.plan_id,
            "is_success": self._success is not None and coverage >= self._success,
        }
