"""Many teams in common arrays, stepped by compiled calls on several threads."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.envs.batch import Batch
from houseexpo.pseudoslam.envs.spec import EnvSpec, new_constants
from houseexpo.pseudoslam.kernels.collision import PERSON
from houseexpo.pseudoslam.kernels.step import SKIP, STEP
from houseexpo.pseudoslam.kernels.team_step import Others
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.teams.team import Floats, Grid, Team, around_of, moves_people, new_measures, take_note

Bools = npt.NDArray[np.bool_]


class TeamPools:
    """The episodes of N teams with R robots each: a ``Batch`` of N for the robots with the same number.

    ``put`` moves a team's arrays into the pools. From then on, its arrays are views of them, and ``step`` takes the
    steps of all teams: the kernels and the order of ``Team.step``, with the same bits.

    Parameters
    ----------
    threads
        Number of threads; it does not change the results.
    """

    def __init__(self, spec: EnvSpec, teams: int, robots: int, threads: int | None = None) -> None:
        self.spec, self.teams = spec, teams
        params = spec.params()
        self.batches = [
            Batch(teams, spec.config, params, threads, moves=moves_people(spec.config, robot))
            for robot in range(robots)
        ]
        self.constants = [new_constants(teams) for _ in range(robots)]
        self.placed: list[Team | None] = [None] * teams
        self.together = new_measures(teams)
        self.observable = np.ones(teams)
        self.around, self._params, self._walks = around_of(spec, params), params, moves_people(spec.config, 0)
        self._walls: Grid = np.zeros((teams, 0), np.uint8)
        self._known: Grid = np.zeros((teams, 0), np.uint8)
        self._meets = np.zeros(teams, np.uint8)

    def put(self, i: int, team: Team) -> None:
        """Move the arrays of a team into place ``i``; the team that was there is no longer valid."""
        first, before = self.batches[0], self._width
        for robot, (batch, state) in enumerate(zip(self.batches, team.states, strict=True)):
            batch.put(i, state)
            batch.state(i).view[...] = state.view
            self.constants[robot].rows[i] = team.constants.rows[robot]
        cells, width = team.walls.size, self._width
        if width > self._walls.shape[1]:
            self._walls, self._known = _wider(self._walls, width), _wider(self._known, width)
        self._walls[i, :cells], self._known[i, :cells] = team.walls.ravel(), team.known.ravel()
        self.together[i], self.observable[i] = team.together[0], team.observable[0]
        self.placed[i] = team
        moved = range(self.teams) if before != width else [i]
        for k in moved:
            self._bind(k, tuple(first.sizes[k].tolist()))

    @property
    def _width(self) -> int:
        """The number of cells for which the pools have room."""
        batch = self.batches[0]
        return batch.arrays.occupied.shape[1] if hasattr(batch, "arrays") else 0

    def _bind(self, i: int, shape: tuple[int, ...]) -> None:
        """Make the arrays of the team at place ``i`` views of the pools."""
        team = self.placed[i]
        if team is None:
            return
        cells = shape[0] * shape[1]
        team.states = [batch.state(i) for batch in self.batches]
        team.walls = self._walls[i, :cells].reshape(shape)
        team.known = self._known[i, :cells].reshape(shape)
        team.together, team.observable = self.together[i : i + 1], self.observable[i : i + 1]

    def step(self, motions: Floats, active: Bools) -> tuple[list[Metrics], list[Metrics]]:
        """Step the ``active`` teams (N,) by motions (N, R, 2) or commands (N, R, 3), and let them exchange their maps.

        Return for each robot's number the metrics of N robots before the exchange and after it.
        """
        wanted = np.where(active, STEP, SKIP).astype(np.uint8)
        people = self.batches[0].arrays.bodies.people if self._walks else np.zeros((self.teams, 0), PERSON)
        others = Others(
            self._walls, people, self.batches[0].arrays.bodies.robots, self._meets, float(self._params.robot.radius_px),
            float(self._params.walk.radius_px),
        )  # fmt: skip
        around, robots = self.around, len(self.batches)
        for robot, batch in enumerate(self.batches):
            pool, sizes, own = batch.arrays, batch.sizes, np.ascontiguousarray(motions[:, robot])
            had = pool.counts["known"][:, 0].copy()
            if robots > 1:
                batch.share(
                    lambda first, end, pool=pool, sizes=sizes, own=own, robot=robot: around.prepare(  # type: ignore[misc]
                        pool, sizes, own, others, (robot, first, end)
                    )
                )
            batch.step(own, wanted)
            batch.share(
                lambda first, end, pool=pool, sizes=sizes, had=had, robot=robot: around.gather(  # type: ignore[misc]
                    pool, sizes, others, self._known, self.together, had, (robot, first, end)
                )
            )
        seen = self.metrics()
        self.together["steps"] += active
        return seen, self._exchange(seen, active)

    def _exchange(self, seen: list[Metrics], active: Bools) -> list[Metrics]:
        """Let the robots of each active team exchange maps, take note of the step, and return the metrics then."""
        joined, robots = np.full(self.teams, len(self.batches) == 1), len(self.batches)
        found, teams = seen, [i for i in np.flatnonzero(active).tolist() if robots > 1]
        if teams and self._team(teams[0]).radio.model != "none":
            for i in teams:
                team = self._team(i)
                team.exchange()
                joined[i] = team.is_joined
            found = self.metrics()
        ways_px = np.stack([each.readings["path_length"] for each in seen], axis=1)
        rows = self.together[active]
        take_note(rows, joined[active], ways_px.sum(axis=1)[active] / self._ppm, self.observable[active])
        self.together[active] = rows
        return found

    @property
    def _ppm(self) -> float:
        return self.spec.config.pixels_per_metre

    def _team(self, i: int) -> Team:
        team = self.placed[i]
        assert team is not None  # noqa: S101  # only placed teams are active
        return team

    def metrics(self) -> list[Metrics]:
        """Return for each robot's number the metrics of N robots."""
        return [
            Metrics.of(constants, batch.arrays, self.spec.config)
            for constants, batch in zip(self.constants, self.batches, strict=True)
        ]

    def close(self) -> None:
        """End the threads."""
        for batch in self.batches:
            batch.close()


def _wider(raster: Grid, width: int) -> Grid:
    """Return rasters with room for ``width`` cells."""
    found = np.zeros((len(raster), width), np.uint8)
    found[:, : raster.shape[1]] = raster
    return found


def of_team(metrics: list[Metrics], i: int) -> Metrics:
    """Return the metrics of the robots of team ``i`` (R,), of metrics by number (R of N)."""

    def rows(name: str) -> Any:
        return np.stack([getattr(each, name)[i] for each in metrics])

    first = metrics[0]
    return Metrics(
        type(first.constants).of(np.stack([each.constants.rows[i] for each in metrics])),
        rows("counts"), rows("readings"), rows("pose_px"), first.config, first.cell_m, rows("explored_m2"),
        rows("coverage"), rows("poses"),
    )  # fmt: skip
