"""Define the task of a team that covers a house or chosen rooms: bring a tool over every cell that it can reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
from gymnasium import spaces

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.checks import check_number, check_one_of
from houseexpo.pseudoslam.envs.spec import EnvSpec
from houseexpo.pseudoslam.kernels.walls import mark_sweepable_cells, mark_swept_cells
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.tasks import ExplorationReward
from houseexpo.pseudoslam.teams.tasks.rasters import (
    Grid,
    check_room_names,
    draw_rasters,
    find_standing_grid,
    make_raster_space,
    number_rooms,
)
from houseexpo.pseudoslam.teams.tasks.task import Array, Floats, TeamEpisode, TeamTask
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import House


@dataclass(frozen=True)
class Coverage(TeamTask):
    """The task of covering rooms, as a cleaning robot does (Choset, 2001; Galceran and Carreras, 2013).

    A robot covers the cells that its tool, a disc round its centre, sweeps: those whose centre comes within ``tool_m``
    of the straight way of a step, with no wall between. The cells to cover are those of the chosen rooms that the tool
    reaches from some place where a robot can stand. An episode terminates when the share ``success_coverage`` of them
    is covered.

    Parameters
    ----------
    rooms
        The labels of the rooms to cover, such as ("Kitchen", "Bedroom"); None for the whole house. A plan that
        records no rooms is divided by ``FloorPlan.divided``.
    tool_m
        The radius of the tool, metres; None for the robot's own.
    reward
        "area": the area that the robot is the first to cover, m2. "coverage": the same as a share of all.

    Notes
    -----
    An observation has "todo" (2, side, side) uint8, pictures as of ``rasters.draw_rasters``: 255 for cells that are not
    covered yet. All robots know what the others have covered.

    ``info["team"]`` has ``covered``, the covered share; ``overlap``, the share of passes that went over cells which
    were already covered; and ``steps_to_cover``, the steps until the end, None before. A pass begins when a cell comes
    under a robot's tool that was not under it in the step before.
    """

    rooms: Sequence[str] | None = None
    tool_m: float | None = None
    success_coverage: float = 0.95
    reward: ExplorationReward = "area"

    name = "coverage"
    default = SimulatorConfig(known_map=True, max_steps=1000)

    def __post_init__(self) -> None:
        check_room_names(self.rooms, "rooms")
        object.__setattr__(self, "rooms", None if self.rooms is None else tuple(self.rooms))
        if self.tool_m is not None:
            check_number(self.tool_m, "tool_m", above=0.0, at_most=10.0)
        check_number(self.success_coverage, "success_coverage", above=0.0, at_most=1.0)
        check_one_of(self.reward, "reward", get_args(ExplorationReward))

    @property
    def house_matters(self) -> bool:  # type: ignore[override]  # a constant of other tasks
        """Whether rooms are chosen."""
        return self.rooms is not None

    def spaces(self, spec: EnvSpec, robots: int) -> dict[str, spaces.Space[Any]]:
        """Return the space of the pictures of what is left to cover."""
        del robots
        return {"todo": make_raster_space(spec)}

    def begin(self, team: Team, house: House | None) -> TeamEpisode:
        """Return the task's part of an episode; raise ConfigError if the house has no such rooms, or no such cells."""
        wanted = (team.walls == 0).view(np.uint8)
        if self.rooms is not None:
            wanted &= (number_rooms(team, house, self.rooms, "rooms") > 0).view(np.uint8)
        return CoverageEpisode(team, self, wanted)


class CoverageEpisode(TeamEpisode):
    """What has been covered in an episode; ``todo`` (rows, cols) is 1 for cells that are left."""

    def __init__(self, team: Team, task: Coverage, wanted: Grid) -> None:
        super().__init__(team)
        self._task = task
        radius_m = team.spec.config.robot.radius_m if task.tool_m is None else task.tool_m
        self.radius_px = radius_m * team.ppm
        self._cells = np.zeros_like(wanted)
        mark_sweepable_cells(team.walls, find_standing_grid(team).copy(), self.radius_px, wanted, self._cells)
        self._number = int(np.count_nonzero(self._cells))
        if not self._number:
            raise ConfigError(
                f"tool_m: a tool of {radius_m:g} m reaches no cell of the rooms to cover in plan "
                f"{team.world.plan_id!r}; choose a larger tool, smaller robots or other rooms"
            )
        self.todo: Grid = self._cells.copy()
        self._places = team.places_px()
        self._under = np.zeros((len(team), *wanted.shape), np.uint8)
        self._passes = 0
        self._steps_to: int | None = None
        self._cover()

    def _cover(self) -> Floats:
        """Sweep the ways since the last call; return how many cells each robot was the first to cover (n,)."""
        places, found = self.team.places_px(), np.zeros(len(self.team))
        for k, (x, y, to_x, to_y) in enumerate(np.hstack([self._places, places]).tolist()):
            under = np.zeros_like(self.todo)
            mark_swept_cells(self.team.walls, x, y, to_x, to_y, self.radius_px, self._cells, under)
            self._passes += int(np.count_nonzero(under > self._under[k]))
            found[k] = np.count_nonzero(under & self.todo)
            self.todo[under != 0] = 0
            self._under[k] = under
        self._places = places
        if self._steps_to is None and self.covered >= self._task.success_coverage:
            self._steps_to = self.team.measures.steps
        return found

    @property
    def covered(self) -> float:
        """The covered share of the cells, 0 to 1."""
        return 1.0 - int(np.count_nonzero(self.todo)) / self._number

    def step(self, before: Metrics, seen: Metrics, ahead: Bools) -> Floats:
        """Return the newly covered areas or shares (n,)."""
        del before, ahead
        unit = seen.cell_m**2 if self._task.reward == "area" else 1.0 / self._number
        return self._cover() * unit

    def success(self, now: Metrics) -> bool:
        """Return whether enough is covered."""
        del now
        return self._steps_to is not None

    def observe(self) -> dict[str, Array]:
        """Return the pictures of what is left to cover."""
        return {"todo": draw_rasters(self.team, self.todo * np.uint8(255))}

    def report(self) -> dict[str, float | None]:
        """Return the covered share, the overlap and the steps."""
        done = self._number - int(np.count_nonzero(self.todo))
        return {
            "covered": self.covered,
            "overlap": max(1.0 - done / max(self._passes, 1), 0.0),
            "steps_to_cover": self._steps_to,
        }
