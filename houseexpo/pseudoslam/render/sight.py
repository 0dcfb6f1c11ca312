"""Measure a robot's beams, and find people and moving shapes that they hit; for pictures and ``service.drive``."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np

from houseexpo.pseudoslam.kernels.body_tracks import track_pose_at
from houseexpo.pseudoslam.kernels.collision import MOVING, placed_people
from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams
from houseexpo.pseudoslam.render.canvas import Points
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State

SECTOR_BEAMS: Final = 721
"""Number of corners of the edge of a drawn sector."""


class MovingBody(NamedTuple):
    """A moving obstacle: a polygon enlarged by a radius, both in pixels, and whether the robot sees it.

    ``velocity_px`` is the velocity of a person, (x across, y down) in pixels per second; shapes on trajectories have
    none.
    """

    corners: Points
    round_px: float
    seen: bool
    velocity_px: tuple[float, float] = (0.0, 0.0)


class Sight(NamedTuple):
    """What the robot currently sees, in pixels: lengths of beams (n,) from right to left, and moving obstacles.

    ``bodies`` (k, 6) are the number, x, y, radius and velocity (x across, y down, pixels per second) of each, where the
    robot believes them to be. An obstacle keeps its number for the whole episode.
    """

    ranges: Points
    bodies: Points


def measure_sight(simulator: Simulator, state: State, beams: int) -> Sight:
    """Return what the robot sees with a number of beams; moving obstacles are found with the beams of pictures."""
    true, moving = state.pose_px, state.episode.bodies
    found = []
    if len(moving.people) + len(moving.clocks) > 0:
        for number, body in enumerate(find_bodies(simulator, state, beam_ends(simulator, state))):
            if body.seen:
                corners = move_to_belief(body.corners, true, state.believed_px)
                centre = corners.mean(axis=0)
                ahead = move_to_belief(
                    body.corners.mean(axis=0) + np.array([body.velocity_px]), true, state.believed_px
                )[0]
                radius = np.hypot(*(corners - centre).T).max() + body.round_px
                found.append((number, *centre, radius, *(ahead - centre)))
    ranges = np.hypot(*(beam_ends(simulator, state, beams) - true[:2]).T)
    return Sight(ranges, np.array(found).reshape(-1, 6))


def beam_ends(simulator: Simulator, state: State, beams: int = SECTOR_BEAMS) -> Points:
    """Return the ends of the beams (n, 2) in pixels, from right to left."""
    laser = simulator.config.laser
    half = math.radians(laser.fov_deg) / 2
    angles = np.linspace(-half, half, beams)
    x, y, heading = state.pose_px
    ranges = np.empty(beams)
    range_px = laser.range_m * simulator.config.pixels_per_metre
    cast_beams(state.occupied, x, y, heading, np.cos(angles), np.sin(angles), range_px, ranges)
    return np.stack([x + ranges * np.cos(heading + angles), y - ranges * np.sin(heading + angles)], axis=1)


def move_to_belief(points: Points, true: Points, believed: Points) -> Points:
    """Return points moved with the robot from its true pose to the believed one."""
    turn = believed[2] - true[2]
    right, down = (points - true[:2]).T
    cos, sin = math.cos(turn), math.sin(turn)
    return np.stack([believed[0] + right * cos + down * sin, believed[1] - right * sin + down * cos], axis=1)


def find_bodies(simulator: Simulator, state: State, ends: Points) -> list[MovingBody]:
    """Return people and shapes on trajectories; ``ends`` are from ``beam_ends``."""
    episode, radius = state.episode, simulator.params.walk.radius_px
    met = _ends_on_moving(state, ends)
    people = placed_people(episode.bodies.people)
    places = np.stack([people["x"], people["y"]], axis=1)
    velocities = zip(people["vx"].tolist(), people["vy"].tolist(), strict=True)
    found = [
        MovingBody(place[None], radius, _is_met(met, place, radius), velocity)
        for place, velocity in zip(places, velocities, strict=True)
    ]
    tracks = episode.tracks
    for k, clock in enumerate(episode.bodies.clocks):
        x, y, heading = track_pose_at(tracks, k, clock)
        shape = tracks.shapes[k]
        ahead, left = tracks.corners[k, : shape.corners].T
        cos, sin = math.cos(heading), math.sin(heading)
        corners = np.stack([x + ahead * cos - left * sin, y - ahead * sin - left * cos], axis=1)
        seen = _is_met(met, np.array([x, y]), float(shape.reach))
        found.append(MovingBody(corners, float(shape.grown), seen))
    return found


def _ends_on_moving(state: State, ends: Points) -> Points:
    """Return the ends (n, 2) of the beams that hit a moving obstacle."""
    way = ends - state.pose_px[:2]
    within = ends + 0.5 * way / np.maximum(np.hypot(*way.T), 1e-9)[:, None]  # half a cell beyond the rim
    rows, cols = state.occupied.shape
    col, row = np.floor(within).astype(int).T
    met: Points = ends[(state.occupied[row.clip(0, rows - 1), col.clip(0, cols - 1)] & MOVING) != 0]
    return met


def _is_met(met: Points, centre: Points, reach: float) -> bool:
    return bool((np.hypot(*(met - centre).T) <= reach + 1.0).any())
