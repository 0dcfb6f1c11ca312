"""The sensor as the kernels take it: its fan, its scratch memory, and its draws of noise."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.world import scan_buffers

Floats = npt.NDArray[np.float64]


class Laser:
    """A configured sensor.

    ``fan`` and ``scratch`` are the kernels' arguments of those names, in order: whether rays are followed, half the
    angle, the range in cells, the rays' cosines and sines; room for free cells, obstacles, slopes, and a patch.
    """

    def __init__(self, config: SimulatorConfig) -> None:
        laser = config.laser
        self.range_px = laser.range_m * config.pixels_per_metre
        half = math.radians(laser.fov_deg) / 2
        angles = np.arange(-half, half, math.radians(laser.resolution_deg))
        self.beams = len(angles)
        self.fan = (laser.rule == "rays", half, self.range_px, np.cos(angles), np.sin(angles))
        free, hit, slopes = scan_buffers(self.range_px)
        if laser.rule == "rays":
            free, hit = np.empty(self.beams * (round(self.range_px) + 1), np.int32), np.empty(self.beams, np.int32)
        side = 2 * math.ceil(self.range_px) + 3
        self.scratch = (free, hit, slopes, np.zeros((side, side) if config.noise.any else (1, 1), np.uint8))
        noise, ppm = config.noise, config.pixels_per_metre
        self._laser_px = noise.laser_m * ppm
        self._error = np.array([noise.registration_m * ppm, noise.registration_m * ppm, 0.0])
        self._error[2] = math.radians(noise.registration_deg)
        self._noisy = noise.any
        self._none = np.zeros((1, self.beams)), np.zeros(3)

    def draw(self, scans: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Return the shifts (scans, beams) along the rays and one error (3,) of registration; no draw without noise."""
        if not self._noisy:
            return self._none
        return rng.normal(0.0, 1.0, (scans, self.beams)) * self._laser_px, rng.normal(0.0, 1.0, 3) * self._error
