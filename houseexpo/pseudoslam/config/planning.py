"""Configuration of planners: the number of frontiers, the length of an action, the density of a graph."""

from __future__ import annotations

from dataclasses import dataclass

from houseexpo.pseudoslam.config.checks import number, whole

MAX_FRONTIERS, MAX_NODES, MAX_NEIGHBOURS = 1024, 4096, 24


@dataclass(frozen=True)
class PlanningConfig:
    """Configuration of planners' actions and of ``observation="graph"``, in addition to the simulator's.

    Parameters
    ----------
    frontiers
        Largest number of frontiers to choose from.
    large_m, least_m
        Frontiers at least ``large_m`` long come first in the ranking; those shorter than ``least_m`` are left out.
    settled_m
        A frontier counts as seen when its middle is known and there is no unknown cell beside a free one within this
        distance (in x and in y) of the middle.
    reach_m
        Distance of a waypoint of (1, 1) ahead and to the left, metres; None for half the side of the view.
    max_steps
        Largest number of simulator steps in one action.
    spacing_m
        Approximate distance between the graph's nodes.
    nodes, neighbours
        Largest number of nodes of a graph, and of neighbours of a node.
    """

    frontiers: int = 16
    large_m: float = 0.4
    least_m: float = 0.0
    settled_m: float = 0.5
    reach_m: float | None = None
    max_steps: int = 60
    spacing_m: float = 0.8
    nodes: int = 256
    neighbours: int = 8

    def __post_init__(self) -> None:
        whole(self.frontiers, "planning.frontiers", at_least=1, at_most=MAX_FRONTIERS)
        whole(self.max_steps, "planning.max_steps", at_least=1)
        whole(self.nodes, "planning.nodes", at_least=1, at_most=MAX_NODES)
        whole(self.neighbours, "planning.neighbours", at_least=1, at_most=MAX_NEIGHBOURS)
        number(self.spacing_m, "planning.spacing_m", above=0.0, at_most=1000.0)
        for name in ("large_m", "least_m", "settled_m"):
            number(getattr(self, name), f"planning.{name}", at_least=0.0, at_most=1000.0)
        if self.reach_m is not None:
            number(self.reach_m, "planning.reach_m", above=0.0, at_most=1000.0)
