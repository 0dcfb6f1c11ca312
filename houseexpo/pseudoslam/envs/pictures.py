"""Draw the maps in observations of N environments other than the plain view: with other pixels, or at several scales.

The step itself draws the plain view with one pixel per cell. These maps are drawn after it, by all threads.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.compiling import compiled_function
from houseexpo.pseudoslam.kernels.episode import Blocks, Episode
from houseexpo.pseudoslam.kernels.map_pictures import GOAL, NEAR, ROBOT, PictureScales, draw_pictures
from houseexpo.pseudoslam.kernels.mapping import side_of_block
from houseexpo.pseudoslam.metrics import EpisodeConstants

Bytes: TypeAlias = npt.NDArray[np.uint8]
Work: TypeAlias = Callable[[int, int], None]
"""A function for the environments from one number up to but excluding another."""


def count_channels(config: SimulatorConfig, *, several: bool) -> int:
    """Return the number of pictures: one, or those of several scales and of the marks."""
    if not several:
        return NEAR + 1
    return (GOAL if config.goal_place else ROBOT) + 1


def picture_side_px(config: SimulatorConfig) -> int:
    """Return the width and height of a picture in pixels."""
    return config.observation.pixels or config.side_px


def near_pixel_width(config: SimulatorConfig) -> float:
    """Return the width of a pixel of the near picture in cells of the map."""
    view = config.observation
    return 1.0 if view.pixels is None else view.size_m * config.pixels_per_metre / view.pixels


def picture_scales(config: SimulatorConfig) -> PictureScales:
    """Return the scales of the pictures of a configuration."""
    side, view, ppm = picture_side_px(config), config.observation, config.pixels_per_metre
    return PictureScales(
        near_pixel_width(config),
        view.far_size_m * ppm / side,
        view.global_size_m * ppm / side,
        float(config.robot.radius_m * ppm),  # an int would compile the kernel again
        float(config.goal_place.radius_m * ppm) if config.goal_place else 0.0,
    )


def block_sides_px(config: SimulatorConfig, *, several: bool) -> tuple[int, int, int]:
    """Return the side of the blocks of the near, the far and the whole picture in cells, 0 if its cells are shown."""
    widths = picture_scales(config)[: len(Blocks._fields) if several else 1]
    sides = [side if (side := side_of_block(width)) > 1 else 0 for width in widths]
    near, far, whole = (*sides, 0, 0)[:3]
    return near, far, whole


class Pictures:
    """The pictures of N environments: (N, channels, side, side) uint8.

    Parameters
    ----------
    several
        Whether to draw the near, far and whole map and the marks of the robot and of the goal, or only the near map.
    """

    def __init__(self, number: int, config: SimulatorConfig, *, several: bool) -> None:
        side, ppm = picture_side_px(config), config.pixels_per_metre
        self._scales = picture_scales(config)
        self._cells_per_metre = np.array([ppm, -ppm], float) if several and config.goal_place else None
        self._goals = np.full((number, 2), np.nan)
        self._draw: Callable[..., None] | None = None
        self.shown = np.zeros((number, count_channels(config, several=several), side, side), np.uint8)

    def __getstate__(self) -> dict[str, Any]:
        """Pickle and copy without the compiled function, which the copy finds again."""
        return {**self.__dict__, "_draw": None}

    def draw(
        self,
        pool: Episode,
        sizes: npt.NDArray[np.int64],
        wanted: Bytes,
        constants: EpisodeConstants,
        share: Callable[[Work], None],
        *,
        fresh: bool = False,
    ) -> Bytes:
        """Draw the pictures that are ``wanted`` (N,) (see ``kernels.step``) of the episodes of a pool.

        Parameters
        ----------
        share
            A function that calls the work for all environments, on one thread or on several.
        fresh
            Whether to draw into a new array, like ``EpisodeBatch.step``.
        """
        if fresh:
            self.shown = np.empty_like(self.shown)
        if self._cells_per_metre is not None:
            np.subtract(constants.goal_m, constants.corner_m[:, :2], out=self._goals)
            np.multiply(self._goals, self._cells_per_metre, out=self._goals)
        given = (
            pool.known, sizes, pool.pose, pool.readings, pool.changed, pool.blocks, self._goals, wanted, self._scales,
            self.shown,
        )  # fmt: skip
        if self._draw is None:
            self._draw = compiled_function(draw_pictures, *given, 0, 0)
        run = self._draw
        share(lambda first, end: run(*given, first, end))
        return self.shown
