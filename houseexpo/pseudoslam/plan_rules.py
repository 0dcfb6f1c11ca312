"""The parameters of planners, for finding frontiers and travelling, in the form of the kernels."""

from __future__ import annotations

import math

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.planning import PlanningConfig
from houseexpo.pseudoslam.kernels.planning.outlook import OutlookRules
from houseexpo.pseudoslam.kernels.planning.plan import (
    BY_FRONTIER,
    BY_NEIGHBOUR,
    BY_WAYPOINT,
    FrontierRules,
    GraphRules,
    PlanRules,
    TravelRules,
)
from houseexpo.pseudoslam.kernels.types import Offsets

LARGE_M = 0.4
"""Frontiers of this length, metres, come before shorter ones."""
ENOUGH = 0.95
"""A step with this share of the best progress is taken if it needs fewer turns: 18 degrees cost 5% of the way."""
MAX_FRONTIERS, MAX_BUMPS = 64, 4
"""The number of frontiers that an explorer considers, and how often it may be blocked on its way to one."""
_SPARE_PX = 1.5
_NEAR_M = 1.0  # goals this close to a frontier are tried before all others that see it
_FAN = 32  # directions in which unknown cells are counted from a place
_SAMPLES_PER_M = 4  # samples in a box, in rows and in columns
_AIM_M = 1.5  # how far ahead on its path the robot aims


KINDS = {"frontier": BY_FRONTIER, "waypoint": BY_WAYPOINT, "neighbour": BY_NEIGHBOUR}


def plan_rules(config: SimulatorConfig, planning: PlanningConfig, actions: str) -> PlanRules:
    """Return the parameters of a planner's actions of one of ``KINDS``."""
    robot, ppm = config.robot, float(config.pixels_per_metre)
    frontiers = frontier_rules(config, planning.large_m, planning.least_m)
    return PlanRules(
        KINDS[actions],
        frontiers,
        TravelRules(
            float(robot.radius_m * ppm),
            float(robot.step_m * ppm),
            math.radians(robot.turn_deg),
            round(planning.settled_m * ppm),
            max(round(_AIM_M * ppm), 4),
            planning.max_steps,
        ),
        GraphRules(max(round(planning.spacing_m * ppm), 1), frontiers.range_px, frontiers.spare_px),
    )


def frontier_rules(config: SimulatorConfig, large_m: float = LARGE_M, least_m: float = 0.0) -> FrontierRules:
    """Return the parameters for finding frontiers."""
    ppm = config.pixels_per_metre
    radius_px = config.robot.radius_m * ppm
    return FrontierRules(
        float(radius_px),
        float(config.laser.range_m * ppm),
        max(round(large_m * ppm), 1),
        max(round(least_m * ppm), 1),
        float(radius_px),
        max(round(config.laser.range_m * ppm), 1),
        near_offsets(max(_NEAR_M * ppm, 2 * radius_px)),
    )


def explorer_frontiers(config: SimulatorConfig) -> FrontierRules:
    """Return the parameters of explorers, which may find other frontiers close to one that was given up."""
    return frontier_rules(config)._replace(spare_px=_SPARE_PX)


def first_looks(config: SimulatorConfig) -> int:
    """Return the number of turns until the robot has looked in all directions."""
    return math.ceil((360.0 - config.laser.fov_deg) / config.robot.turn_deg - 1e-9)


def outlook_rules(config: SimulatorConfig) -> OutlookRules:
    """Return the parameters for describing frontiers."""
    ppm = float(config.pixels_per_metre)
    angles = np.arange(_FAN) * (2 * math.pi / _FAN)
    frontiers = frontier_rules(config)
    apart = max(round(ppm / _SAMPLES_PER_M), 1)
    return OutlookRules(ppm, frontiers.range_px, frontiers.large, apart, np.cos(angles), np.sin(angles))


def near_offsets(reach_px: float) -> Offsets:
    """Return the offsets of the cells within reach, nearest first, in the form of ``FrontierRules.near``."""
    reach = math.ceil(reach_px)
    found = np.mgrid[-reach : reach + 1, -reach : reach + 1].reshape(2, -1).T
    squared = (found**2).sum(axis=1)
    order = np.lexsort((found[:, 1], found[:, 0], squared))
    return np.ascontiguousarray(found[order[squared[order] <= reach_px**2]].astype(np.int16))
