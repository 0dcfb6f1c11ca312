"""What is measured: tasks whose sensor, resolution, robot and horizon belong to the id.

A track is never changed: what would change its numbers gets a new version.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.agents.protocol import Interface
from houseexpo.pseudoslam.benchmark import measures
from houseexpo.pseudoslam.benchmark.trace import Trace
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv, NavigationEnv, ObstacleAvoidanceEnv, PseudoSlamEnv
from houseexpo.pseudoslam.tasks import ROOM, Navigation, ObstacleAvoidance
from houseexpo.words import nearest

Metric = measures.Metric
BUDGETS: Final = (100, 200, 400, 800)
"""Steps, and metres."""
SHARES: Final = (90, 95, 99)
"""Per cent of what can be seen."""


@dataclass(frozen=True)
class Track:
    """A task of the benchmark.

    Parameters
    ----------
    name
        What the command takes for the newest version.
    id
        Names the version: results of one id can be compared.
    about
        What the robot is to do, in a sentence.
    config
        All that is fixed; ``max_steps`` is the horizon. A policy chooses only how it is shown its surroundings.
    task, arguments
        The environment, and what it is told beside the configuration.
    metrics
        What is reported, the one that tables are sorted by first.
    measure
        From an episode to a value for each metric; None where there is none (a share that was not reached).
    curves
        What coverage is drawn over, "steps" or "metres", and how far.
    """

    name: str
    id: str
    about: str
    config: SimulatorConfig
    task: Literal["exploration", "avoidance", "navigation"]
    arguments: dict[str, Any]
    metrics: tuple[Metric, ...]
    measure: Callable[[Trace], dict[str, float | None]]
    curves: tuple[tuple[str, int], ...] = ()

    @property
    def needs_plans(self) -> bool:
        """Whether it runs in plans; the other one has a room of its own."""
        return self.task != "avoidance"

    def environment(self, plans: Dataset | list[FloorPlan], interface: Interface) -> PseudoSlamEnv:
        """Return an environment of the track as a policy wants to see it."""
        make: dict[str, Callable[..., PseudoSlamEnv]] = {
            "exploration": ExplorationEnv,
            "avoidance": ObstacleAvoidanceEnv,
            "navigation": NavigationEnv,
        }
        config = self.config if interface.view is None else replace(self.config, observation=interface.view)
        houses = plans if self.needs_plans else ROOM
        shown = {"actions": interface.actions, "observation": interface.observation}
        return make[self.task](houses, config, **self.arguments, **shown)

    def record(self) -> dict[str, Any]:
        """Return what a result says of it; ``observation`` is the policy's affair."""
        config = self.config.to_mapping()
        del config["observation"]
        return {"id": self.id, "about": self.about, "task": self.task, "config": config}


_EXPLORER = SimulatorConfig(max_steps=4000)
"""25 px/m, a robot of 0.2 m that goes 0.3 m or turns 10 degrees, a laser of 5 m and 180 degrees, no noise."""

TRACKS: Final = (
    Track(
        "budget", "exploration-budget-v1",
        "See as much of a house as a budget of steps or metres allows.",
        _EXPLORER, "exploration", {"success_coverage": 1.0},
        measures.budget_metrics(BUDGETS), measures.Budget(BUDGETS), (("steps", 800), ("metres", 200)),
    ),
    Track(
        "quality", "exploration-quality-v1",
        "See 99% of a house, by a short way.",
        _EXPLORER, "exploration", {"success_coverage": 0.99},
        measures.quality_metrics(SHARES), measures.Quality(SHARES),
    ),
    Track(
        "avoidance", "avoidance-v1",
        "Keep moving in the paper's room among 1 to 5 obstacles, and touch none: 200 steps, the paper's reward.",
        replace(ObstacleAvoidance.default, max_steps=200), "avoidance", {},
        measures.AVOIDANCE, measures.avoidance,
    ),
    Track(
        "navigation", "navigation-v1",
        "Go to a place in a house whose map is known.",
        replace(Navigation.default, max_steps=1000), "navigation", {},
        measures.NAVIGATION, measures.navigation,
    ),
    Track(
        "pointgoal", "pointgoal-v1",
        "Go to a place in a house that nobody has seen yet.",
        replace(Navigation.default, max_steps=1000, known_map=False), "navigation", {},
        measures.NAVIGATION, measures.navigation,
    ),
)  # fmt: skip


def track_of(name: str) -> Track:
    """Return a track by its name or id; ConfigError where there is none."""
    for track in TRACKS:
        if name in {track.name, track.id}:
            return track
    known = ", ".join(track.name for track in TRACKS)
    raise ConfigError(
        f"--track: expected one of {known}, or the id of one; found {name!r}" + nearest(name, known.split(", "))
    )
