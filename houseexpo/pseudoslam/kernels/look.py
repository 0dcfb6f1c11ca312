"""Scan from the robot's pose, and merge the scan into the map.

Functions that only a step calls are inlined in it (``inline``). Otherwise they would be compiled separately, with all
functions that they call.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.episode import BEAMS, REGISTRATION, Episode, StepParams, key_of
from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE, merge_cells, merge_runs
from houseexpo.pseudoslam.kernels.sensing.noise import (
    draw_beams,
    draw_noisy,
    merge_patch,
    registration,
)
from houseexpo.pseudoslam.kernels.sensing.rays import ray_merge, ray_scan
from houseexpo.pseudoslam.kernels.sensing.sector import sector_scan
from houseexpo.pseudoslam.kernels.types import Scratch
from houseexpo.pseudoslam.kernels.whole import whole


@njit(inline="always")
def look_at_sector(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Scan the sector from the robot's pose, and merge the scan into the map."""
    pose, sensor = episode.pose, params.sensor
    n_runs, n_hit = sector_scan(
        episode.occupied, pose.x, pose.y, pose.heading, sensor.half_fov, sensor.range_px, scratch.runs, scratch.hit,
        scratch.slopes,
    )  # fmt: skip
    new, covered = merge_runs(episode.known, episode.observable, scratch.runs, n_runs, whole(FREE))
    _count(episode, scratch, n_hit, new, covered)


@njit(inline="always")
def look_along_rays(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Scan along the rays from the robot's pose, and merge the scan into the map."""
    pose, sensor = episode.pose, params.sensor
    settled = len(episode.bodies.clocks) + len(episode.bodies.people) == 0
    new, covered, n_hit = ray_merge(
        episode.occupied, episode.observable, episode.known, pose.x, pose.y, pose.heading, sensor.fan_cos,
        sensor.fan_sin, sensor.range_px, scratch.hit, settled,
    )  # fmt: skip
    _count(episode, scratch, n_hit, new, covered)


@njit(inline="always")
def _count(episode: Episode, scratch: Scratch, n_hit: int, new: int, covered: int) -> None:
    """Merge the visible obstacles after the free cells, and count new cells."""
    new_hit, covered_hit = merge_cells(episode.known, episode.observable, scratch.hit, n_hit, whole(OBSTACLE))
    episode.counts.known += new + new_hit
    episode.counts.covered += covered + covered_hit
    episode.counts.scans += 1


@njit(inline="always")
def look(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Scan according to the parameters, including noise."""
    if params.errors.any:
        _look_with_errors(episode, params, scratch)
    elif params.sensor.by_rays:
        look_along_rays(episode, params, scratch)
    else:
        look_at_sector(episode, params, scratch)


@njit(inline="always")
def _look_with_errors(episode: Episode, params: StepParams, scratch: Scratch) -> None:
    """Merge a scan with the noise of its beams, at the believed pose and with the error of registration."""
    pose, counts, sensor, errors = episode.pose, episode.counts, params.sensor, params.errors
    x, y, heading, runs, hit = pose.x, pose.y, pose.heading, scratch.runs, scratch.hit
    if sensor.by_rays:
        n_runs, n_hit = ray_scan(
            episode.occupied, x, y, heading, sensor.fan_cos, sensor.fan_sin, sensor.range_px, runs, hit
        )
    else:
        n_runs, n_hit = sector_scan(
            episode.occupied, x, y, heading, sensor.half_fov, sensor.range_px, runs, hit, scratch.slopes
        )
    beams = len(sensor.fan_cos)
    shift_px, fate = np.empty(beams), np.empty(beams, np.int32)
    draw_beams(errors, beams, key_of(counts.key, BEAMS), counts.scans, shift_px, fate)
    draw_noisy(
        scratch.patch, episode.occupied.shape[1], x, y, heading, sensor, runs, n_runs, hit, n_hit, shift_px, fate
    )
    right, down, turn = registration(errors, key_of(counts.key, REGISTRATION), counts.steps)
    new, covered = merge_patch(
        episode.known, episode.observable, scratch.patch, x, y, pose.seen_x - x + right, pose.seen_y - y + down,
        pose.seen_heading - heading + turn,
    )  # fmt: skip
    _count(episode, scratch, 0, new, covered)
