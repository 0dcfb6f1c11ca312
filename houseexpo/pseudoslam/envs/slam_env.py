"""Explore on the map of a real SLAM: an environment whose belief is made by scan matching, not by the simulator.

After each step the SLAM (``slam.ScanMatcher``) gets the pose that noisy odometry predicts from its last pose, and the
noisy ranges from where the robot now is. Its map and its pose replace the simulator's: observations, coverage and
reward are those of the SLAM's map. One scan is used for each step, at its end.

Coverage counts cells that can be observed and that the map knows at their true place. A map that drifts covers wrong
cells, which also count if they can be observed; the errors of pose and map say how far to trust it.
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
from houseexpo.pseudoslam.kernels.sensing.noise import HIT, LOST, draw_beam_errors
from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams
from houseexpo.pseudoslam.kernels.types import Floats
from houseexpo.pseudoslam.metrics import Bools, Metrics
from houseexpo.pseudoslam.slam import ScanMatcher
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
