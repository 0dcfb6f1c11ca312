"""People in the form of the kernels: how they walk, and where they start."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config.dynamics import PeopleConfig
from houseexpo.pseudoslam.kernels.motion.bodies import HALF_DIAGONAL, PERSON, Bodies, Disc, Tracks
from houseexpo.pseudoslam.kernels.people.social_force import FEELER, Walk
from houseexpo.pseudoslam.kernels.people.spawn import place_people
from houseexpo.pseudoslam.kernels.planning.flow import Flow

_FEELERS, _RINGS_M = 12, (0.07, 0.2)  # directions of feelers, and their distances from a person's rim
_WALL_M_S2, _WALL_M = 6.0, 0.15  # the acceleration at a wall, and the distance over which it falls to 37%


def walk_of(config: PeopleConfig, pixels_per_metre: float) -> Walk:
    """Return the parameters of people's walking on a grid."""
    radius_px = max(config.radius_m * pixels_per_metre, HALF_DIAGONAL)
    feelers = [
        _feeler(2 * math.pi * k / _FEELERS, ring_m, radius_px, pixels_per_metre)
        for k in range(_FEELERS)
        for ring_m in _RINGS_M
    ]
    return Walk(
        float(pixels_per_metre),
        radius_px,
        float(config.relaxation_s),
        2 * radius_px,
        np.array(feelers, FEELER),
        radius_px + max(_RINGS_M) * pixels_per_metre + 1e-6,
    )


def _feeler(angle: float, ring_m: float, radius_px: float, ppm: float) -> tuple[float, float, float, float]:
    """Return the point of a feeler and its push away, scaled so that walls in half of all directions give all of it."""
    right, down = math.cos(angle), math.sin(angle)
    reach, push = radius_px + ring_m * ppm, _WALL_M_S2 * ppm * math.exp(-ring_m / _WALL_M) * math.pi / _FEELERS
    return right * reach, down * reach, -right * push, -down * push


def new_bodies(tracks: int, people: int) -> Bodies:
    """Return the state of a number of bodies at the start, before people are placed."""
    return Bodies(np.zeros(tracks), np.zeros(people, PERSON))


def start_people(  # noqa: PLR0917  # the kernel's arguments, in its order
    config: PeopleConfig,
    occupied: npt.NDArray[np.uint8],
    bodies: Bodies,
    tracks: Tracks,
    flow: Flow,
    walk: Walk,
    key: int,
    robot: Disc,
    plan_id: str,
) -> None:
    """Place people at random and give them speeds and goals, without drawing them in ``occupied`` (static bits only).

    People without a place remain 0 in ``bodies.there``.

    Raises
    ------
    ConfigError
        There is space for fewer than ``config.least`` people.
    """
    ppm = walk.pixels_per_metre
    placed = place_people(
        occupied,
        bodies,
        tracks,
        flow,
        walk,
        key,
        robot,
        config.away_m * ppm,
        config.speed_m_s * ppm,
        config.speed_sd * ppm,
    )
    bodies.people[placed:] = 0
    if placed < config.least:
        raise ConfigError(
            f"people.least: {config.least} people of radius {config.radius_m:g} m find no place in plan "
            f"{plan_id!r}, {placed} did; ask for fewer, or for smaller ones"
        )
