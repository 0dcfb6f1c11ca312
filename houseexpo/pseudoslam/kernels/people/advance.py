"""Move people and bodies on tracks in one step of one environment."""

from __future__ import annotations

import math

from numba import njit

from houseexpo.pseudoslam.kernels.motion.bodies import (
    Bodies,
    Disc,
    Tracks,
    erase,
    pose_at,
    stamp_disc,
    stamp_track,
    track_keeps_off,
)
from houseexpo.pseudoslam.kernels.people.social_force import Walk
from houseexpo.pseudoslam.kernels.people.walking import walk_on
from houseexpo.pseudoslam.kernels.planning.flow import Flow
from houseexpo.pseudoslam.kernels.types import Grid

SUBSTEP_S = 0.1
"""Longest time for which forces are taken as constant, seconds."""


@njit(cache=True, nogil=True)
def advance(
    occupied: Grid,
    bodies: Bodies,
    tracks: Tracks,
    flow: Flow,
    walk: Walk,
    key: int,
    robot: Disc,
    seconds: float,
) -> None:
    """Move all bodies for a time, and the moving bits of ``occupied`` with them; the robot's disc does not move.

    Bodies on tracks move first; the clock of one that would run into the robot or a person stops. Then people walk. No
    body covers a cell that touches the robot's disc.
    """
    if len(bodies.clocks) + len(bodies.people) == 0:
        return
    erase_bodies(occupied, bodies, tracks, walk)
    parts = _substeps(bodies, tracks, walk, robot.radius, seconds)
    for _ in range(parts):
        for k in range(len(bodies.clocks)):
            _run(bodies, tracks, walk, k, robot, seconds / parts)
        walk_on(occupied, bodies, tracks, flow, walk, key, robot, seconds / parts)
    stamp_bodies(occupied, bodies, tracks, walk)


@njit(cache=True, nogil=True)
def stamp_bodies(occupied: Grid, bodies: Bodies, tracks: Tracks, walk: Walk) -> None:
    """Set the moving bits of all bodies, by cells' centres."""
    for k in range(len(bodies.clocks)):
        stamp_track(occupied, tracks, k, bodies.clocks[k])
    for p in range(len(bodies.people)):
        stamp_disc(occupied, bodies.people[p].x, bodies.people[p].y, walk.radius_px)


@njit(cache=True, nogil=True)
def erase_bodies(occupied: Grid, bodies: Bodies, tracks: Tracks, walk: Walk) -> None:
    """Clear the moving bits of all bodies."""
    for k in range(len(bodies.clocks)):
        x, y, _ = pose_at(tracks, k, bodies.clocks[k])
        erase(occupied, x, y, tracks.shapes[k].reach)
    for p in range(len(bodies.people)):
        erase(occupied, bodies.people[p].x, bodies.people[p].y, walk.radius_px)


@njit(cache=True, nogil=True)
def _substeps(bodies: Bodies, tracks: Tracks, walk: Walk, robot_radius: float, seconds: float) -> int:
    """Return the number of substeps, so that no body on a track can jump over the robot or a person."""
    parts = math.ceil(seconds / SUBSTEP_S - 1e-9)
    least = min(robot_radius, walk.radius_px) if len(bodies.people) > 0 else robot_radius
    for k in range(len(bodies.clocks)):
        parts = max(parts, math.ceil(tracks.shapes[k].fastest * seconds / least))
    return max(parts, 1)


@njit(cache=True, nogil=True)
def _run(
    bodies: Bodies,
    tracks: Tracks,
    walk: Walk,
    k: int,
    robot: Disc,
    seconds: float,
) -> None:
    """Advance a track's clock unless its body is blocked."""
    before = bodies.clocks[k]
    after, end = before + seconds, tracks.times_s[k, tracks.shapes[k].poses - 1]
    if after > end:
        after = after % end if tracks.shapes[k].loops else end
    if not track_keeps_off(tracks, k, before, after, robot, True):
        return
    for p in range(len(bodies.people)):
        person = Disc(bodies.people[p].x, bodies.people[p].y, walk.radius_px)
        if not track_keeps_off(tracks, k, before, after, person, False):
            return
    bodies.clocks[k] = after
