"""``python -m houseexpo.pseudoslam.precompile_worker KERNEL``: compile a step's kernel to disk."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.thread_pool import compiled
from houseexpo.pseudoslam.kernels.motion.bodies import no_tracks
from houseexpo.pseudoslam.kernels.planning.distance_field import no_field
from houseexpo.pseudoslam.kernels.planning.flow import no_flow
from houseexpo.pseudoslam.kernels.step import Episode
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.step_params import KERNELS, arguments_of, scratch_of, step_params_of
from houseexpo.pseudoslam.worlds.people import new_bodies


def example() -> tuple[Any, ...]:
    """Return what a kernel takes: it is compiled for kinds of arrays, however long they are."""
    raster, config = np.zeros((1, 1), np.uint8), SimulatorConfig()
    episode = Episode(
        raster, raster, raster, raster, raster, np.zeros(1), np.zeros(6), np.zeros(7, np.int64), np.zeros(5),
        new_bodies(0, 0), no_tracks(), no_flow(), no_field(),
    )  # fmt: skip
    return arguments_of(State(episode, 0), np.zeros((1, 2)), step_params_of(config), scratch_of(config))


if __name__ == "__main__":
    compiled(KERNELS[sys.argv[1]], example())
