"""Define the benchmark's tracks, tasks with a fixed sensor, resolution, robot and horizon, and make their environments.

A track is never changed; anything that would change its numbers becomes a new version.
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
from houseexpo.pseudoslam.benchmark.measures import Trace
from houseexpo.pseudoslam.config import GoalConfig, LaserConfig, NoiseConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, WalkModel
from houseexpo.pseudoslam.envs.single import ExplorationEnv, NavigationEnv, ObstacleAvoidanceEnv, PseudoSlamEnv
from houseexpo.pseudoslam.envs.slam_env import SlamEnv
from houseexpo.pseudoslam.tasks import ROOM, Navigation, ObstacleAvoidance
from houseexpo.pseudoslam.worlds.maps import MapHouse
from houseexpo.words import suggest_name

Metric = measures.Metric
Houses = Dataset | list[FloorPlan] | list[MapHouse]
BUDGETS: Final = (100, 200, 400, 800)
"""Steps, and metres."""
LONG_BUDGETS: Final = (200, 400, 800, 1600)
"""Steps, and metres, on plans of several hundred square metres."""
SHARES: Final = (90, 95, 99)
"""Per cent of the observable area."""


@dataclass(frozen=True)
class Track:
    """A task of the benchmark.

    Parameters
    ----------
    name
        The name of the newest version on the command line.
    id
        The id of the version; results with the same id can be compared.
    about
        The robot's task, in one sentence.
    config
        The fixed configuration; ``max_steps`` is the horizon. A policy can only choose its view of the surroundings.
    task, arguments
        The environment, and its arguments other than the configuration.
    metrics
        The reported metrics; tables are sorted by the first one.
    measure
        A function from an episode to a value for each metric, None for no value (a share that was not reached).
    curves
        The horizontal axes of curves of coverage, "steps" or "metres", and their length.
    """

    name: str
    id: str
    about: str
    config: SimulatorConfig
    task: Literal["exploration", "avoidance", "navigation", "search"]
    arguments: dict[str, Any]
    metrics: tuple[Metric, ...]
    measure: Callable[[Trace], dict[str, float | None]]
    curves: tuple[tuple[str, int], ...] = ()
    slam: bool = False
    """Whether a SLAM draws the robot's map, and not the simulator."""
    largest: int = 0
    """How many of the largest plans of a list the track draws from; 0 for all plans."""
    floors: tuple[str, ...] = ()
    """The names of the floors of ``kth`` that the track runs on; none for all that have starts."""

    @property
    def needs_plans(self) -> bool:
        """Whether the track uses plans; otherwise it has its own room."""
        return self.task != "avoidance"

    @property
    def budgets_m(self) -> tuple[int, ...]:
        """The budgets of metres after which coverage is measured; none for tracks without budgets."""
        return self.measure.budgets if isinstance(self.measure, measures.CoverageAtBudgets) else ()

    def environment(self, plans: Houses, interface: Interface) -> PseudoSlamEnv:
        """Return an environment of the track with the interface of a policy."""
        make: dict[str, Callable[..., PseudoSlamEnv]] = {
            "exploration": ExplorationEnv,
            "avoidance": ObstacleAvoidanceEnv,
            "navigation": NavigationEnv,
            "search": NavigationEnv,
            "slam": SlamEnv,
        }
        config = self.config if interface.view is None else replace(self.config, observation=interface.view)
        houses: Houses | FloorPlan = plans if self.needs_plans else ROOM
        shown: dict[str, Any] = {"actions": interface.actions, "observation": interface.observation}
        shown |= {"action_mask": True} if interface.action_mask else {}
        return make["slam" if self.slam else self.task](houses, config, **self.arguments, **shown)

    def record(self) -> dict[str, Any]:
        """Return the record of the track in results, without ``observation``, which the policy chooses."""
        config = self.config.to_mapping()
        del config["observation"]
        return {"id": self.id, "about": self.about, "task": self.task, "config": config}


_EXPLORER = SimulatorConfig(max_steps=4000)
"""25 px/m, a robot of 0.2 m radius with steps of 0.3 m or 10 degrees, a laser of 5 m and 180 degrees, no noise."""
_FINE_LASER: Final = LaserConfig(5.0, 180.0, 0.25)
"""Beams are 2.2 cm apart at 5 m, less than a cell: a SLAM draws beams, and beams 0.7 degrees apart leave out cells."""
_NOISE: Final = NoiseConfig(laser_m=0.02, odometry_way=0.02, odometry_turn=0.02, odometry_deg_per_m=0.5, drop_out=0.05)
"""Errors of a cheap laser and of wheels without slip; the map drifts with the odometry, as without loop closure."""
_OBJECTS: Final = ("bed", "chair", "plant", "sofa", "toilet", "tv stand")
"""The six kinds of ObjectNav's challenge of 2022 (Habitat), in the words of the houses that the project furnishes."""

_SOCIAL: Final[tuple[tuple[str, WalkModel, str], ...]] = (
    ("social", "social-force", ", and keep away from them."),
    ("social-orca", "orca", " by ORCA, and keep away from them."),
)

TRACKS: Final = (
    Track(
        "budget", "exploration-budget-v1",
        "See as much of a house as a budget of steps or metres allows.",
        _EXPLORER, "exploration", {"success_coverage": 1.0},
        measures.budget_metrics(BUDGETS), measures.CoverageAtBudgets(BUDGETS), (("steps", 800), ("metres", 200)),
    ),
    Track(
        "quality", "exploration-quality-v1",
        "See 99% of a house, by a short way.",
        _EXPLORER, "exploration", {"success_coverage": 0.99},
        measures.steps_to_coverage_metrics(SHARES), measures.StepsToCoverage(SHARES),
    ),
    Track(
        "avoidance", "avoidance-v2",
        "Drive as far as 200 steps allow in the paper's room of 5.5 x 3.2 m, among 1 to 5 obstacles, and touch none.",
        replace(ObstacleAvoidance.default, max_steps=200), "avoidance", {},
        measures.AVOIDANCE, measures.measure_avoidance,
    ),
    Track(
        "navigation", "navigation-v2",
        "Go to a place in a house whose map is known.",
        replace(Navigation.default, max_steps=1000), "navigation", {},
        measures.NAVIGATION, measures.measure_navigation,
    ),
    Track(
        "pointgoal", "pointgoal-v2",
        "Go to a place in a house that nobody has seen yet.",
        replace(Navigation.default, max_steps=1000, known_map=False), "navigation", {},
        measures.NAVIGATION, measures.measure_navigation,
    ),
    Track(
        "roomgoal", "roomgoal-v1",
        "Go to a room of a given kind, such as the kitchen, in a house that nobody has seen yet.",
        replace(Navigation.default, max_steps=1000, known_map=False, goal=GoalConfig(kind="room", least_way_m=5.0)),
        "search", {},
        measures.NAVIGATION, measures.measure_navigation,
    ),
    Track(
        "objectgoal", "objectgoal-v1",
        "Go to a piece of furniture of a given kind, such as a bed, in a furnished house that nobody has seen yet.",
        replace(Navigation.default, max_steps=1000, known_map=False, goal=GoalConfig(kind="object", names=_OBJECTS)),
        "search", {},
        measures.NAVIGATION, measures.measure_navigation,
    ),
    Track(
        "large", "exploration-large-v1",
        "See as much of one of the largest houses as a budget of steps or metres allows.",
        replace(_EXPLORER, max_steps=6000), "exploration", {"success_coverage": 1.0},
        measures.budget_metrics(LONG_BUDGETS), measures.CoverageAtBudgets(LONG_BUDGETS),
        (("steps", 1600), ("metres", 400)),
        largest=500,
    ),
    Track(
        "noisy", "exploration-noisy-v2",
        "See as much of a house as a budget allows, with drifting odometry and a laser that errs.",
        replace(_EXPLORER, noise=_NOISE), "exploration", {"success_coverage": 1.0},
        measures.budget_metrics(BUDGETS), measures.CoverageAtBudgets(BUDGETS), (("steps", 800), ("metres", 200)),
    ),
    Track(
        "people", "exploration-people-v1",
        "See as much of a house in which up to four people walk as a budget allows.",
        replace(_EXPLORER, people=PeopleConfig(4)), "exploration", {"success_coverage": 1.0},
        measures.budget_metrics(BUDGETS), measures.CoverageAtBudgets(BUDGETS), (("steps", 800), ("metres", 200)),
    ),
    *(
        Track(
            name, f"{name}-v1",
            "Go to a place in a house whose map is known and in which up to eight people walk" + how,
            replace(Navigation.default, max_steps=1000, people=PeopleConfig(8, model=model)), "navigation", {},
            measures.SOCIAL, measures.SocialNavigation(Navigation.default.step_s),
        )
        for name, model, how in _SOCIAL
    ),
    Track(
        "slam", "exploration-slam-v2",
        "See as much of a house as a budget allows, on the map of a SLAM that corrects the odometry of `noisy`.",
        replace(_EXPLORER, noise=_NOISE, laser=_FINE_LASER, max_steps=2000), "exploration", {"success_coverage": 1.0},
        (*measures.budget_metrics(BUDGETS), *measures.SLAM), measures.CoverageAndSlamErrors(BUDGETS),
        (("steps", 800), ("metres", 200)),
        slam=True,
    ),
)  # fmt: skip


_MAPEX_WAY_M: Final = 300
"""MapEx's 1,000 steps of three cells of 0.1 m."""
_ROUND_20M: Final = LaserConfig(20.0, 360.0, 0.144)
_PIPE: Final = {
    "small": (150, ("50052749", "50052750")),
    "medium": (300, ("50010535_PLAN1", "50010535_PLAN2", "50010536_PLAN3")),
    "large": (600, ("50015847", "50015848")),
}
"""PIPE's classes of floors (castacks/pipe-planner, ``scripts/explore.py``): metres of 500, 1,000 and 2,000 steps."""


def _pipe(size: str, way_m: int, floors: tuple[str, ...]) -> Track:
    """Return PIPE's task on a class of floors, with MapEx's starts, sensor and robot."""
    budgets = (way_m // 2, way_m)
    return Track(
        f"pipe-{size}", f"pipe-{size}-v1",
        f"Know as much of PIPE's {size} floors as a way of {way_m} m allows, seen and predicted, from MapEx's starts.",
        SimulatorConfig(10.0, RobotConfig(0.1), _ROUND_20M, max_steps=20 * way_m),
        "exploration", {"success_coverage": 1.0},
        measures.metre_budget_metrics(budgets), measures.CoverageAtBudgets(budgets), (("metres", way_m),),
        floors=floors,
    )  # fmt: skip


MAP_TRACKS: Final = (
    Track(
        "kth", "kth-v1",
        "See as much of MapEx's floors as a way of 300 m allows, from its 24 starts.",
        SimulatorConfig(10.0, RobotConfig(0.1), _ROUND_20M, max_steps=6000),
        "exploration", {"success_coverage": 1.0},
        measures.metre_budget_metrics((75, 150, _MAPEX_WAY_M)), measures.CoverageAtBudgets((75, 150, _MAPEX_WAY_M)),
        (("metres", _MAPEX_WAY_M),),
    ),
    Track(
        "dare", "dare-v1",
        "See 99% of DARE's test maps, by a short way.",
        SimulatorConfig(5.0, RobotConfig(0.2, 0.4), _ROUND_20M, max_steps=6000),
        "exploration", {"success_coverage": 0.99},
        measures.steps_to_coverage_metrics(SHARES), measures.StepsToCoverage(SHARES), (("metres", 800),),
    ),
    Track(
        "ariadne", "ariadne-v1",
        "See 99% of ARiADNE's complex maps, by a short way; a cell counts as 0.25 m.",
        SimulatorConfig(4.0, RobotConfig(0.2), _ROUND_20M, max_steps=6000),
        "exploration", {"success_coverage": 0.99},
        measures.steps_to_coverage_metrics(SHARES), measures.StepsToCoverage(SHARES), (("metres", 800),),
    ),
    *(_pipe(size, *of_size) for size, of_size in _PIPE.items()),
)  # fmt: skip
"""The tracks on maps of other people, which ``--maps`` names (``benchmark.maps`` reads them)."""


def find_track(name: str) -> Track:
    """Return a track by its name or id; raise ConfigError if it does not exist."""
    for track in (*TRACKS, *MAP_TRACKS):
        if name in {track.name, track.id}:
            return track
    known = ", ".join(track.name for track in (*TRACKS, *MAP_TRACKS))
    raise ConfigError(
        f"--track: expected one of {known}, or the id of one; found {name!r}" + suggest_name(name, known.split(", "))
    )
