"""Choose the velocity of a person by optimal reciprocal collision avoidance (ORCA).

The method is that of van den Berg, Guy, Lin and Manocha (Reciprocal n-body collision avoidance, 2011). Units are pixels
and seconds; a half-plane ``(n_x, n_y, b)`` allows the velocities v with n v >= b, and n has the length 1.

R1  Velocities with which two discs would touch within the horizon form a cone without its tip. Each person changes the
    relative velocity by half of what leads out of it on the shortest way. The robot and others of its team do nothing,
    as far as a person knows, so that the person does all of it. (Sections 3 and 4)
R2  Walls and bodies on tracks limit the speed towards them, so that they are not reached within ``WALL_HORIZON_S``.
R3  Of the velocities that all half-planes allow, up to the highest speed, it is the one closest to the wish: a linear
    program, solved by adding one half-plane after the other. (Section 5.1)
R4  If there is none, it is the velocity whose largest violation of a half-plane is least. (Section 5.3)
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.body_tracks import BodyTracks, Tracks, nearest_body_point, to_body_frame
from houseexpo.pseudoslam.kernels.collision import Disc
from houseexpo.pseudoslam.kernels.tolerances import FASTEST_SHARE, PARALLEL_SINE, WALL_HORIZON_S
from houseexpo.pseudoslam.kernels.types import Floats, Grid, Rows

_AS_DIRECTION = 1e6
"""How far away a wish lies that stands for a direction, as a multiple of the highest speed."""


@njit(cache=True, nogil=True)
def choose_velocity(
    occupied: Grid, bodies: BodyTracks, tracks: Tracks, feelers: Rows, horizon_s: float, radius: float, robot: Disc,
    p: int, wish_x: float, wish_y: float, seconds: float,
) -> tuple[float, float]:  # fmt: skip
    """Return the velocity of person ``p``, who wishes to go in a direction of length 1, or 0 to stand."""
    people, me = bodies.people, bodies.people[p]
    planes = np.empty((len(people) + len(bodies.robots) + len(feelers) + len(bodies.clocks) + 1, 3))
    n, most = 0, FASTEST_SHARE * me.speed
    for i in range(len(people)):
        if i != p:
            n += add_disc(
                planes, n, people[i].x - me.x, people[i].y - me.y, me.vx, me.vy, people[i].vx, people[i].vy,
                2.0 * radius, 0.5, horizon_s, seconds, most,
            )  # fmt: skip
    for k in range(max(len(bodies.robots), 1)):
        x, y = (robot.x, robot.y) if k == 0 else (bodies.robots[k, 0], bodies.robots[k, 1])
        n += add_disc(
            planes, n, x - me.x, y - me.y, me.vx, me.vy, 0.0, 0.0, radius + robot.radius, 1.0, horizon_s, seconds, most
        )
    rows, cols = occupied.shape
    for i in range(len(feelers)):
        col, row = math.floor(me.x + feelers[i].x), math.floor(me.y + feelers[i].y)
        if not (0 <= row < rows and 0 <= col < cols) or occupied[row, col] != 0:
            off = math.hypot(feelers[i].x, feelers[i].y)
            planes[n] = -feelers[i].x / off, -feelers[i].y / off, (radius - off) / WALL_HORIZON_S  # R2
            n += 1
    for k in range(len(bodies.clocks)):
        ahead, left, cos, sin = to_body_frame(tracks, k, bodies.clocks[k], me.x, me.y)
        gap, a, b = nearest_body_point(tracks, k, ahead, left)
        off = math.hypot(a, b)
        if off > 0.0:
            planes[n] = (a * cos - b * sin) / off, -(a * sin + b * cos) / off, (radius - gap) / WALL_HORIZON_S
            n += 1
    return solve_half_planes(planes[:n], most, me.speed * wish_x, me.speed * wish_y)


@njit(cache=True, nogil=True)
def add_disc(
    planes: Floats, n: int, off_x: float, off_y: float, vx: float, vy: float, by_vx: float, by_vy: float,
    touch: float, share: float, horizon_s: float, seconds: float, most: float,
) -> int:  # fmt: skip
    """Write the half-plane of another disc at an offset (R1) and return 1, or 0 for one that is too far away.

    ``touch`` is the sum of the radii. Discs that overlap are to part within ``seconds``.
    """
    off = math.hypot(off_x, off_y)
    if off == 0.0 or off - touch > horizon_s * (most + math.hypot(by_vx, by_vy)):
        return 0
    within = horizon_s if off > touch else seconds
    rel_x, rel_y = vx - by_vx, vy - by_vy
    tip_x, tip_y = rel_x - off_x / within, rel_y - off_y / within
    tip, along = math.hypot(tip_x, tip_y), tip_x * off_x + tip_y * off_y
    if off <= touch or (along < 0.0 and along * along > touch * touch * tip * tip):  # the round end is nearest
        n_x, n_y = (tip_x / tip, tip_y / tip) if tip > 0.0 else (-off_x / off, -off_y / off)
        out = touch / within - tip
    else:  # one of the sides
        leg, side = math.sqrt(off * off - touch * touch), 1.0 if off_x * tip_y > off_y * tip_x else -1.0
        n_x = -(off_x * touch + side * off_y * leg) / (off * off)
        n_y = -(off_y * touch - side * off_x * leg) / (off * off)
        out = -(rel_x * n_x + rel_y * n_y)
    planes[n, 0], planes[n, 1], planes[n, 2] = n_x, n_y, n_x * vx + n_y * vy + share * out
    return 1


@njit(cache=True, nogil=True)
def solve_half_planes(planes: Floats, most: float, wish_x: float, wish_y: float) -> tuple[float, float]:
    """Return the velocity of R3, or that of R4; ``most`` is the highest speed."""
    failed, vx, vy = _closest(planes, most, wish_x, wish_y)
    if failed == len(planes):
        return vx, vy
    worst, beside = 0.0, np.empty_like(planes)
    for i in range(failed, len(planes)):
        n_x, n_y, b = planes[i, 0], planes[i, 1], planes[i, 2]
        if b - n_x * vx - n_y * vy <= worst:
            continue
        n = 0
        for j in range(i):  # where j is violated no more than i
            m_x, m_y = planes[j, 0] - n_x, planes[j, 1] - n_y
            size = math.hypot(m_x, m_y)
            if size > PARALLEL_SINE:
                beside[n] = m_x / size, m_y / size, (planes[j, 2] - b) / size
                n += 1
        stopped, new_x, new_y = _closest(beside[:n], most, n_x * _AS_DIRECTION * most, n_y * _AS_DIRECTION * most)
        if stopped == n:
            vx, vy = new_x, new_y
        worst = b - n_x * vx - n_y * vy
    return vx, vy


@njit(cache=True, nogil=True)
def _closest(planes: Floats, most: float, wish_x: float, wish_y: float) -> tuple[int, float, float]:
    """Return the number of half-planes that can be met, in order, and the velocity closest to the wish in these."""
    slower = most / max(math.hypot(wish_x, wish_y), most, PARALLEL_SINE)
    vx, vy = wish_x * slower, wish_y * slower
    for i in range(len(planes)):
        n_x, n_y, b = planes[i, 0], planes[i, 1], planes[i, 2]
        if n_x * vx + n_y * vy >= b:
            continue
        if abs(b) > most:
            return i, vx, vy
        high = math.sqrt(most * most - b * b)
        low = -high
        for j in range(i):
            slope = planes[j, 1] * n_x - planes[j, 0] * n_y
            rest = planes[j, 2] - b * (planes[j, 0] * n_x + planes[j, 1] * n_y)
            if abs(slope) <= PARALLEL_SINE:
                low = math.inf if rest > 0.0 else low
            elif slope > 0.0:
                low = max(low, rest / slope)
            else:
                high = min(high, rest / slope)
        if low > high:
            return i, vx, vy
        at = min(max(wish_y * n_x - wish_x * n_y, low), high)
        vx, vy = b * n_x - at * n_y, b * n_y + at * n_x
    return len(planes), vx, vy
