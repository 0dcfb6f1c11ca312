"""Hold many teams in common arrays, and step them by compiled calls on several threads; for ``TeamVectorEnv``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.envs.episode_batch import EpisodeBatch
from houseexpo.pseudoslam.envs.spec import EnvSpec, new_episode_constants
from houseexpo.pseudoslam.kernels.bound_pool import BoundPool
from houseexpo.pseudoslam.kernels.step import SKIP, STEP
from houseexpo.pseudoslam.kernels.team_step import TeamKnowledge, TeamObstacles
from houseexpo.pseudoslam.metrics import Metrics
from houseexpo.pseudoslam.teams.tasks import Radio
from houseexpo.pseudoslam.teams.team import (
    Floats,
    Grid,
    RadioContact,
    Team,
    count_chunks,
    disc_sizes_px,
    make_team_kernels,
    moves_people,
    new_knowledge,
    new_radio_contact,
    note_exchange,
    shares_map_changes,
)

Bools = npt.NDArray[np.bool_]


class TeamPools:
    """The episodes of N teams with R robots each: a ``EpisodeBatch`` of N * R robots, team after team.

    ``put`` moves a team's arrays into the pools. From then on, its arrays are views of them, and ``step`` takes the
    steps of all teams. The robots of a team move one after the other; after all have, those that hear each other
    exchange their maps.

    Parameters
    ----------
    threads
        Number of threads; it does not change the results.
    """

    def __init__(self, spec: EnvSpec, radio: Radio, teams: int, robots: int, threads: int | None = None) -> None:
        self.spec, self.radio, self.teams, self.robots = spec, radio, teams, robots
        params = spec.params()
        self.batch = EpisodeBatch(teams * robots, spec.config, params, threads, moves=False)
        self.constants = new_episode_constants(teams * robots)
        self.placed: list[Team | None] = [None] * teams
        self.observable = np.ones(teams)
        self.contact: RadioContact = new_radio_contact(teams, robots)
        self.around, self._params = make_team_kernels(spec, params, radio), params
        self._walks = moves_people(spec.config, 0)
        self._walls: Grid = np.zeros((teams, 0), np.uint8)
        self._shared = new_knowledge(teams, robots, 0, 0)
        self._drawn: Floats = np.zeros((teams * robots, 0, 2))
        self._meets, self._had = np.zeros(teams, np.uint8), np.zeros(teams, np.int64)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a pickle or a copy, in which the arrays of teams are no views of the pools yet."""
        self.__dict__.update(state)
        for i, team in enumerate(self.placed):
            if team is not None:
                self.bind(i)

    @property
    def together(self) -> Any:
        """What the teams have done so far (N,) ``kernels.team_step.TOGETHER``."""
        return self._shared.together

    def put(self, i: int, team: Team) -> None:
        """Move the arrays of a team into place ``i``; the team that was there is no longer valid."""
        first, before = i * self.robots, self._width
        rows = slice(first, first + self.robots)
        for row, state in enumerate(team.states, start=first):
            self.batch.put(row, state)
            self.batch.state(row).view[...] = state.view
        self.constants.rows[rows] = team.constants.rows
        if before != self._width:
            self._widen(team.others.drawn.shape[1])
        cells, width, shared = team.walls.size, self._width, self._shared
        self._walls[i, :cells], shared.known[i, :cells] = team.walls.ravel(), team.shared.known[0]
        for own, other in zip(
            (shared.pending, shared.waiting), (team.shared.pending, team.shared.waiting), strict=True
        ):
            own[i] = 0
            own[i, ..., : other.shape[2]] = other[0]
        self.together[i], self.observable[i] = team.together[0], team.observable[0]
        self._drawn[rows] = team.others.drawn
        contact = self.contact
        contact.heard[i], contact.joined[i] = team.heard, team.is_joined
        self.placed[i] = team
        for k in range(self.teams) if before != width else [i]:
            if self.placed[k] is not None:
                self.bind(k)

    @property
    def _width(self) -> int:
        """The number of cells for which the pools have room."""
        return self.batch.arrays.occupied.shape[1] if hasattr(self.batch, "arrays") else 0

    def _widen(self, drawn: int) -> None:
        """Make room for as many cells as the pool of the robots has, and for discs that are drawn."""
        width, robots, shared = self._width, self.robots, self._shared
        chunks = count_chunks(width) if shares_map_changes(self.radio) and robots > 1 else 0
        self._walls = _wider(self._walls, width)
        self._shared = shared._replace(
            known=_wider(shared.known, width),
            pending=_wider(shared.pending, chunks),
            waiting=_wider(shared.waiting, count_chunks(chunks)),
        )
        if self._drawn.shape[1] != drawn:
            self._drawn = np.full((self.teams * robots, drawn, 2), np.nan)

    def bind(self, i: int) -> Team:
        """Make the arrays of the team at place ``i`` views of the pools; return the team."""
        team = self.team(i)
        first = i * self.robots
        team.states = [self.batch.state(row) for row in range(first, first + self.robots)]
        rows, cols = self.batch.sizes[first].tolist()
        team.walls = self._walls[i, : rows * cols].reshape(rows, cols)
        one, shared, contact = slice(i, i + 1), self._shared, self.contact
        team.shared = TeamKnowledge(shared.known[one], shared.pending[one], shared.waiting[one], shared.together[one])
        team.contact = RadioContact(contact.heard[one], contact.joined[one])
        team.observable = self.observable[one]
        return team

    def team(self, i: int) -> Team:
        """Return the team that was put at place ``i``."""
        team = self.placed[i]
        assert team is not None  # noqa: S101  # only placed teams are asked for
        return team

    def step(self, motions: Floats, active: Bools, *, fresh: bool = True) -> tuple[Metrics, Metrics]:
        """Step the ``active`` teams (N,) by motions (N * R, 2) or commands (N * R, 3), and let them exchange maps.

        Return the metrics of N * R robots before the exchange and after it. With ``fresh``, views are drawn into a new
        array.
        """
        batch, robots, around = self.batch, self.robots, self.around
        if fresh:
            batch.renew_views()
        pool, sizes, others, shared = batch.arrays, batch.sizes, self._others(), self._shared
        wanted = np.full((robots, self.teams, robots), SKIP, np.uint8)
        for robot in range(robots):
            wanted[robot, active, robot] = STEP
        kernels = [batch.kernel(moves=self._walks and robot == 0) for robot in range(robots)]

        def work(bound: BoundPool, first: int, end: int) -> None:
            begin, stop = -(-first // robots), -(-end // robots)  # the teams whose first robots are in this part
            for robot in range(robots):
                part = robot, begin, stop
                around.prepare(pool, sizes, motions, others, part)
                kernels[robot](bound, motions, wanted[robot].ravel(), begin * robots, stop * robots)
                around.gather(pool, sizes, others, shared, part)

        batch.share_bound(work)
        if robots > 1:
            note_exchange(pool, sizes)
        seen = self.metrics()
        return seen, self._exchange(seen, active)

    def _others(self) -> TeamObstacles:
        bodies = self.batch.arrays.bodies
        return TeamObstacles(
            self._walls, bodies.people, bodies.robots, self._drawn, self._meets, self._had,
            *disc_sizes_px(self._params),
        )  # fmt: skip

    def _exchange(self, seen: Metrics, active: Bools) -> Metrics:
        """Let the robots of each active team exchange maps, take note of the step, and return the metrics then."""
        found = seen
        if self.robots > 1 and self.radio.model != "none":
            self._tell(active.astype(np.uint8))
            found = self.metrics()  # of counts that have changed
        ways_px = seen.readings["path_length"].reshape(self.teams, -1)
        self.around.update_measures(self.together, active, self.contact.joined, ways_px, self.observable)
        return found

    def _tell(self, wanted: Grid) -> None:
        batch, robots, others, shared = self.batch, self.robots, self._others(), self._shared
        work: Callable[[int, int], None] = lambda first, end: self.around.exchange(  # noqa: E731
            batch.arrays, batch.sizes, others, shared, self.contact, wanted, (-(-first // robots), -(-end // robots))
        )
        batch.share(work)

    def metrics(self) -> Metrics:
        """Return the metrics of N * R robots."""
        return Metrics.of(self.constants, self.batch.arrays, self.spec.config)

    def close(self) -> None:
        """End the threads."""
        self.batch.close()


def _wider(array: npt.NDArray[Any], width: int) -> npt.NDArray[Any]:
    """Return an array whose last axis has ``width`` values: those of the given array, or the first ones, then zeros."""
    found, kept = np.zeros((*array.shape[:-1], width), array.dtype), min(width, array.shape[-1])
    found[..., :kept] = array[..., :kept]
    return found
