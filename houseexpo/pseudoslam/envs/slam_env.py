"""Explore on the map of a real SLAM: an environment whose belief is made by scan matching, not by the simulator.

After each step the SLAM (``ScanMatcher``) gets the pose that noisy odometry predicts from its last pose, and the
noisy ranges from where the robot now is. Its map and its pose replace the simulator's: observations, coverage and
reward are those of the SLAM's map. One scan is used for each step, at its end.

Coverage counts cells that can be observed and that the map knows at their true place. A map that drifts covers wrong
cells, which also count if they can be observed; the errors of pose and map say how far to trust it.

The SLAM knows what a robot knows: the pose that its odometry predicts, and the ranges of its laser. Its map is a grid
with the frame of the simulator's, in which the first pose is given.

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
from typing import Any, Final, Unpack

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.single import ExplorationEnv
from houseexpo.pseudoslam.envs.spec import AllEnvOptions
from houseexpo.pseudoslam.kernels.collision import wrap_angle
from houseexpo.pseudoslam.kernels.episode import BEAMS, noise_key
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN, crop_view
from houseexpo.pseudoslam.kernels.scan_matching import (
    COARSE,
    INSIDE_PX,
    Evidence,
    add_scan,
    draw_score_field,
    evidence_to_map,
    find_best_pose,
)
from houseexpo.pseudoslam.kernels.sensing.noise import HIT, LOST, draw_beam_errors
from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams
from houseexpo.pseudoslam.kernels.types import Floats, Grid, Sensor
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.worlds.maps import Plans

REPORT: Final = "slam"
"""The key of ``info`` with a function that returns the errors of pose and map so far (``SlamEnv.errors``)."""


class SlamEnv(ExplorationEnv):
    """Exploration with a SLAM in the loop; arguments as for ``ExplorationEnv``.

    Actions are "discrete" or "continuous" and observations are "map": a planner's action takes several steps on the
    simulator's own map. Raise ConfigError for others.
    """

    def __init__(
        self,
        dataset: Plans | None = None,
        config: SimulatorConfig | str | None = None,
        *,
        success_coverage: float | None = None,
        **options: Unpack[AllEnvOptions],
    ) -> None:
        super().__init__(dataset, config, success_coverage=success_coverage, **options)
        if self.actions not in {"discrete", "continuous"} or self.observation != "map":
            raise ConfigError(
                "a SLAM in the loop: expected actions 'discrete' or 'continuous' and the observation 'map', found "
                f"{self.actions!r} and {self.observation!r}"
            )
        self._slam: ScanMatcher | None = None
        self._odometry = np.zeros(3)
        self._corrected = np.zeros(3)
        self._truth = np.zeros(3)
        self._off_px: list[tuple[float, float]] = []

    def errors(self) -> dict[str, float]:
        """Return the errors so far.

        ``ate_m`` is the absolute trajectory error: the root of the mean squared distance between the true position and
        the SLAM's after each step, in the frame of the start, without alignment (Sturm et al., 2012, align both
        trajectories first). ``odometry_ate_m`` is that of odometry alone, ``heading_deg`` the SLAM's heading error
        now. ``iou_seen_free`` and ``iou_seen_walls`` are the IoU of free cells and of obstacles with the true house,
        over the cells that the map knows.
        """
        state = self.state
        squared = np.square(np.array(self._off_px)).mean(axis=0)
        slam_m, odometry_m = (np.sqrt(squared) / self.config.pixels_per_metre).tolist()
        turn = wrap_angle(float(state.believed_px[2] - state.pose_px[2]))
        known, solid = state.known != UNKNOWN, state.occupied != 0
        return {
            "ate_m": slam_m,
            "odometry_ate_m": odometry_m,
            "heading_deg": abs(math.degrees(turn)),
            "iou_seen_free": _iou((state.known == FREE) & known, ~solid & known),
            "iou_seen_walls": _iou((state.known == OBSTACLE) & known, solid & known),
        }

    def _believe(self, *, starts: bool) -> None:
        """Replace the simulator's belief by the SLAM's."""
        state = self.state
        if starts or self._slam is None:
            self._slam = ScanMatcher(state.known.shape, self._params.sensor, self.config.pixels_per_metre)
            predicted = state.believed_px.copy()
            self._odometry, self._off_px = predicted.copy(), []
        else:
            predicted = self._predict_pose()
            self._odometry = _compose_motion(self._odometry, self._corrected, predicted)
        self._truth = state.pose_px.copy()
        self._corrected = self._slam.update(predicted, self._ranges())
        state.poses_px[3:] = self._corrected
        self._slam.draw(state.known)
        state.note_new_map()
        seen = state.known != UNKNOWN
        state.episode.counts["known"][0] = np.count_nonzero(seen)
        state.episode.counts["covered"][0] = np.count_nonzero(seen & (state.episode.observable != 0))
        x, y, heading = self._corrected.tolist()
        crop_view(state.known, x, y, heading, state.view)
        truth = self._truth[:2]
        self._off_px.append((math.dist(self._corrected[:2], truth), math.dist(self._odometry[:2], truth)))

    def _predict_pose(self) -> Floats:
        """Return the pose (3,) that odometry predicts from the SLAM's last pose."""
        if self._params.errors.odometry:
            return self.state.believed_px.copy()
        return _compose_motion(
            self._corrected, self._truth, self.state.pose_px
        )  # the simulator then believes the truth

    def _ranges(self) -> Floats:
        """Return the ranges (beams,) of the last scan with the noise of its beams, pixels."""
        state, sensor, errors = self.state, self._params.sensor, self._params.errors
        beams = len(sensor.fan_cos)
        ranges, shift_px, fate = np.empty(beams), np.zeros(beams), np.full(beams, HIT, np.int32)
        x, y, heading = state.pose_px.tolist()
        cast_beams(state.occupied, x, y, heading, sensor.fan_cos, sensor.fan_sin, sensor.range_px, ranges)
        draw_beam_errors(
            errors, beams, noise_key(int(state.counts.key), BEAMS), int(state.counts.scans) - 1, shift_px, fate
        )
        met = ranges < sensor.range_px
        noisy = np.where(met, np.clip(ranges + shift_px, 0.0, sensor.range_px), sensor.range_px)
        found: Floats = np.where(fate == HIT, noisy, np.where(fate == LOST, 0.0, sensor.range_px))
        return found

    def _info(self, after: Metrics, success: Bools) -> dict[str, Any]:
        return {**super()._info(after, success), REPORT: self.errors}


def _iou(one: Bools, other: Bools) -> float:
    union = int(np.count_nonzero(one | other))
    return int(np.count_nonzero(one & other)) / union if union else 0.0


def _compose_motion(pose: Floats, before: Floats, after: Floats) -> Floats:
    """Return a pose (3,) after the motion that leads from one pose to another, relative to the robot."""
    turn = pose[2] - before[2]
    cos, sin = math.cos(turn), math.sin(turn)
    right, down = after[0] - before[0], after[1] - before[1]
    return np.array([pose[0] + cos * right + sin * down, pose[1] - sin * right + cos * down, after[2] + turn])


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
