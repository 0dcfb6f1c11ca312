"""Estimate pose and map without loop closure: correct odometry by matching each scan with the map of earlier key scans.

It knows what a robot knows: the pose that its odometry predicts, and the ranges of its laser. The map is a grid with
the frame of the simulator's, in which the first pose is given.

R1  The predicted pose is corrected by correlative scan matching (``kernels.scan_matching``; Olson, 2009), within
    ``COARSE`` steps of ``STEP_PX`` and ``STEP_DEG`` of it. Every ``EVERY``-th beam is used.
R2  The prediction stands if fewer than ``FEWEST`` of these beams meet something, or the best score is below ``WORST``.
R3  Scans are matched with key scans only: the first one, and each that is ``KEY_M`` or ``KEY_DEG`` from the last key
    scan. Otherwise each scan would add its own error to what the next one is matched with.
R4  The map shows all scans, drawn beam by beam from their corrected poses. Cells between beams stay unknown.

It has no loop closure, no particles and no graph: errors that have been drawn stay.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from houseexpo.pseudoslam.kernels.collision import wrap_angle
from houseexpo.pseudoslam.kernels.scan_matching import (
    COARSE,
    INSIDE_PX,
    Evidence,
    add_scan,
    draw_score_field,
    evidence_to_map,
    find_best_pose,
)
from houseexpo.pseudoslam.kernels.types import Floats, Grid, Sensor

STEP_PX: Final = 1.0
STEP_DEG: Final = 1.0
WINDOW_PX: Final = COARSE * STEP_PX
DOUBT: Final = 0.1
"""The loss of score at one step from the prediction, the strength of a prior on odometry.

On the tuning plans (the first six published ones of 60 to 250 m2, 400 steps of nearest frontier with the noise of the
track ``noisy``) the error of the path was 0.27 m with 0.002, 0.08 with 0.01, 0.04 with 0.05 and 0.1, 0.07 with 0.5;
odometry alone had 0.22 m.
"""
EVERY: Final = 3
FEWEST: Final = 20
WORST: Final = 0.25
KEY_M: Final = 0.5
KEY_DEG: Final = 30.0
"""With a key scan at each step the error was twice as large on the tuning plans, 0.08 m."""


class ScanMatcher:
    """The SLAM of an episode.

    Parameters
    ----------
    shape
        Rows and columns of the map.
    sensor
        The laser.
    pixels_per_metre
        The resolution of the map.
    """

    def __init__(self, shape: tuple[int, int], sensor: Sensor, pixels_per_metre: float) -> None:
        self._sensor = sensor
        self._all = np.zeros(shape, np.int16)
        self._keys = np.zeros(shape, np.int16)
        self._key_px = KEY_M * pixels_per_metre
        side = 2 * math.ceil(sensor.range_px + WINDOW_PX) + 5
        self._field = np.zeros((side, side))
        self._last_key: Floats | None = None
        self.score = 1.0
        """The score of the last match, 0 to 1; 0 if there was none (R2)."""

    def update(self, predicted: Floats, ranges: Floats) -> Floats:
        """Return the corrected pose (3,) of a scan, and draw the scan from there.

        Parameters
        ----------
        predicted
            The pose (3,) that odometry predicts: pixels (y down) and radians.
        ranges
            (beams,), pixels; 0 for a lost beam, the sensor's range or more for one that meets nothing.
        """
        pose = np.array(predicted, np.float64)
        if self._last_key is not None:
            pose = self._match(pose, self._ends(ranges))
        self._draw(self._all, pose, ranges)
        if self._is_key(pose):
            self._draw(self._keys, pose, ranges)
            self._last_key = pose.copy()
        return pose

    def draw(self, known: Grid) -> None:
        """Write the map (rows, cols): 0 unknown, 127 free, 255 obstacle."""
        evidence_to_map(self._all, known)

    def _is_key(self, pose: Floats) -> bool:
        """Return whether a scan becomes a key scan (R3)."""
        last = self._last_key
        if last is None or math.dist(pose[:2], last[:2]) >= self._key_px:
            return True
        return abs(wrap_angle(float(pose[2] - last[2]))) >= math.radians(KEY_DEG)

    def _draw(self, evidence: Evidence, pose: Floats, ranges: Floats) -> None:
        x, y, heading = pose.tolist()
        sensor = self._sensor
        add_scan(evidence, x, y, heading, sensor.fan_cos, sensor.fan_sin, ranges, sensor.range_px)

    def _ends(self, ranges: Floats) -> Floats:
        """Return the ends (n, 2) of the beams that are matched: pixels ahead and to the left."""
        used, sensor = ranges[::EVERY], self._sensor
        meets = (used > 0.0) & (used < sensor.range_px)
        reach = used[meets] + INSIDE_PX
        ends: Floats = np.stack(
            [reach * sensor.fan_cos[::EVERY][meets], reach * sensor.fan_sin[::EVERY][meets]], axis=1
        )
        return ends

    def _match(self, pose: Floats, ends: Floats) -> Floats:
        self.score = 0.0
        if len(ends) < FEWEST:  # R2
            return pose
        half = len(self._field) // 2
        top, left = math.floor(pose[1]) - half, math.floor(pose[0]) - half
        draw_score_field(self._keys, top, left, self._field)
        found = np.empty(3)
        score = find_best_pose(self._field, top, left, pose, ends, STEP_PX, math.radians(STEP_DEG), DOUBT, found)
        if score < WORST:  # R2
            return pose
        self.score = score
        return found
