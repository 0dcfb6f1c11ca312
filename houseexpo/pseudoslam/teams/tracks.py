"""Define benchmark tracks of teams, run policies on them, and make the table that compares the results."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Final

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.benchmark.cases import seed_from_words
from houseexpo.pseudoslam.benchmark.statistics import Estimate, estimate_mean
from houseexpo.pseudoslam.benchmark.tables import markdown_table
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.reset_options import Pose
from houseexpo.pseudoslam.envs.spec import make_env_spec
from houseexpo.pseudoslam.kernels.collision import disc_is_free
from houseexpo.pseudoslam.kernels.radio import length_in_walls
from houseexpo.pseudoslam.simulator import ACTIONS, action_motions
from houseexpo.pseudoslam.tasks import Exploration
from houseexpo.pseudoslam.teams.policies import TeamPolicy, find_policy_class
from houseexpo.pseudoslam.teams.pools import TeamPools
from houseexpo.pseudoslam.teams.tasks import Radio
from houseexpo.pseudoslam.teams.team import Team
from houseexpo.pseudoslam.worlds.maps import Plans
from houseexpo.pseudoslam.worlds.world import World
from houseexpo.words import suggest_name

SEEN_ENOUGH: Final = 0.99
"""The share of what can be seen at which an episode of a track ends."""
_RIMS_APART_M: Final = 0.1
"""Distance between the rims of robots that start together."""


@dataclass(frozen=True)
class TeamTrack:
    """A task of the benchmark for teams: explore 99% of a house from one place; results of one ``id`` are comparable.

    All robots start beside each other. An episode ends when their maps together know 99% of what can be seen, when no
    robot has a frontier left, or after ``config.max_steps`` steps.
    """

    name: str
    id: str
    robots: int
    config: SimulatorConfig = field(default_factory=lambda: SimulatorConfig(max_steps=2000))
    radio: Radio = field(default_factory=lambda: Radio("signal"))


TRACKS: Final = tuple(TeamTrack(f"team-{n}", f"team-{n}-v1", n) for n in (2, 4, 8))

COLUMNS: Final = {
    "team_coverage": ("seen, %", 100.0),
    "steps_to_90": ("steps to 90%", 1.0),
    "steps_to_99": ("steps to 99%", 1.0),
    "metres_to_90": ("m to 90%, all robots", 1.0),
    "metres_to_99": ("m to 99%, all robots", 1.0),
    "makespan": ("makespan, steps", 1.0),
    "longest_m": ("greatest way, m", 1.0),
    "overlap": ("overlap, %", 100.0),
    "connected": ("connected, %", 100.0),
    "collisions": ("collisions", 1.0),
}
"""The measures of ``Team.report`` in tables: head, and factor."""


def find_team_track(name: str) -> TeamTrack:
    """Return a track by its name or id; raise ConfigError if it does not exist."""
    for track in TRACKS:
        if name in {track.name, track.id}:
            return track
    known = [track.name for track in TRACKS]
    raise ConfigError(f"--track: expected one of {', '.join(known)}; found {name!r}" + suggest_name(name, known))


def run_team(
    track: TeamTrack,
    policy: str,
    dataset: Plans,
    plan_ids: Sequence[str],
) -> dict[str, Any]:
    """Run a policy on a track in plans, and return its result: the measures of each plan, in order.

    A plan without room for the team is noted under ``without_room`` and has no measures.
    """
    kind = find_policy_class(policy)
    spec = make_env_spec(Exploration(SEEN_ENOUGH), dataset, track.config, "discrete", "map")
    pools = TeamPools(spec, track.radio, 1, track.robots, threads=1)
    rows: list[dict[str, Any]] = []
    without: list[str] = []
    for plan_id in plan_ids:
        rng = np.random.default_rng(seed_from_words(track.id, plan_id))
        world = spec.choice.draw(rng, plan_id)
        starts = choose_starts(world, track.config, track.robots, rng)
        if starts is None:
            without.append(plan_id)
            continue
        pools.put(0, Team(spec, world, track.robots, track.radio, rng, starts, pools.around))
        team = run_episode(pools, TeamPolicy(kind, track.config, track.robots))
        rows.append({"plan_id": plan_id, **team.report()})
    record = {"id": track.id, "robots": track.robots, "radio": asdict(track.radio)}
    return {"track": record, "policy": policy, "plans": rows, "without_room": without}


def run_episode(pools: TeamPools, policy: TeamPolicy) -> Team:
    """Let a policy act until the team's episode ends, see ``TeamTrack``; return the team."""
    team, config, still = pools.team(0), pools.spec.config, np.zeros(2)
    table = np.array([action_motions(config)[action] for action in ACTIONS]) * (1.0, config.pixels_per_metre)
    while team.steps < config.max_steps and team.coverage < SEEN_ENOUGH:
        actions = policy(team)
        if all(action is None for action in actions):
            break
        pools.step(np.array([still if action is None else table[action] for action in actions]), np.ones(1, bool))
    return team


def choose_starts(world: World, config: SimulatorConfig, robots: int, rng: np.random.Generator) -> list[Pose] | None:
    """Return poses of robots beside each other, with no wall between them; None if no place is found for all.

    The first is drawn at random; each other one is as near to it as it can be.
    """
    ppm = config.pixels_per_metre
    radius_px, apart_px = config.robot.radius_m * ppm, (2 * config.robot.radius_m + _RIMS_APART_M) * ppm
    cells = np.argwhere(world.traversable != 0)
    middles = cells[:, ::-1] + 0.5
    for _ in range(100):
        first = middles[int(rng.integers(len(middles)))]
        headings = rng.uniform(-math.pi, math.pi, robots).tolist()
        if not disc_is_free(world.occupied, first[0], first[1], radius_px):
            continue
        away = np.hypot(*(middles - first).T)
        order = np.lexsort((middles[:, 0], middles[:, 1], away))
        near = middles[order[away[order] <= 4 * apart_px]]
        placed = [first]
        for place in near:
            if len(placed) == robots:
                break
            x, y = place.tolist()
            if (
                min(math.hypot(*(place - other).tolist()) for other in placed) >= apart_px
                and disc_is_free(world.occupied, x, y, radius_px)
                and length_in_walls(world.occupied, first[0], first[1], x, y) == 0.0
            ):
                placed.append(place)
        if len(placed) == robots:
            points = world.frame.points_from_pixels(np.array(placed)).tolist()
            return [(x, y, heading) for (x, y), heading in zip(points, headings, strict=True)]
    return None


def make_table(results: Sequence[dict[str, Any]]) -> tuple[list[str], list[list[str]]]:
    """Return the heads and the rows of a table of results: means over plans with 95% intervals by bootstrap.

    The steps and metres to a share are over the plans in which it was reached; their number follows after a slash if
    it was not reached in all.
    """
    rows = []
    for result in results:
        plans = result["plans"]
        cells = [str(result["policy"])]
        for name, (_, factor) in COLUMNS.items():
            found = estimate_mean([None if plan[name] is None else factor * plan[name] for plan in plans])
            cells.append(_cell(found, len(plans)))
        rows.append(cells)
    return ["policy", *(head for head, _ in COLUMNS.values())], rows


def _cell(found: Estimate, plans: int) -> str:
    if found.mean is None or found.low is None or found.high is None:
        return "-"
    shown = (f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}" for value in (found.mean, found.low, found.high))
    return "{} [{}, {}]".format(*shown) + (f" /{found.number}" if found.number < plans else "")


def format_track_markdown(track: TeamTrack, results: Sequence[dict[str, Any]]) -> str:
    """Return the table of a track as Markdown, with the numbers of plans."""
    heads, rows = make_table(results)
    without = len(results[0]["without_room"])
    lines = [
        f"## {track.id}",
        "",
        f"{track.robots} robots in {len(results[0]['plans'])} houses"
        + (f" ({without} more had no room for the team)" if without else "")
        + ". Means over houses, 95% intervals by bootstrap. After a slash: the houses in which a share was reached.",
        "",
        *markdown_table(heads, rows),
    ]
    return "\n".join(lines) + "\n"
