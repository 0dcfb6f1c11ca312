"""``python -m houseexpo.pseudoslam.precompile_worker KERNEL``: compile a step's kernel to disk."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.envs.thread_pool import compiled
from houseexpo.pseudoslam.kernels.episode import Episode
from houseexpo.pseudoslam.kernels.motion.bodies import no_tracks
from houseexpo.pseudoslam.kernels.planning.distance_field import no_field
from houseexpo.pseudoslam.kernels.planning.flow import no_flow
from houseexpo.pseudoslam.kernels.runtime.thread_pool import new_sync
from houseexpo.pseudoslam.kernels.step_pool import ARRAYS
from houseexpo.pseudoslam.pools import pool_of_one
from houseexpo.pseudoslam.step_params import KERNELS, scratch_of, step_params_of
from houseexpo.pseudoslam.worlds.people import new_bodies


def example(*, pooled: bool) -> tuple[Any, ...]:
    """Return what a kernel takes: it is compiled for kinds of arrays, however long they are."""
    raster, config = np.zeros((1, 1), np.uint8), SimulatorConfig()
    episode = Episode(
        raster, raster, raster, raster, raster, np.zeros(1), np.zeros(6), np.zeros(7, np.int64), np.zeros(5),
        new_bodies(0, 0), no_tracks(), no_flow(), no_field(),
    )  # fmt: skip
    params, scratch = step_params_of(config), scratch_of(config)
    if not pooled:
        return episode, 0.0, 0.0, params, scratch
    sizes, wanted, views = np.ones((1, 2), np.int64), np.zeros(1, np.uint8), (raster[None],) * ARRAYS
    return pool_of_one(episode), sizes, np.zeros((1, 2)), wanted, params, views, scratch, new_sync(1, 1), 0, 0


if __name__ == "__main__":
    name = sys.argv[1]
    compiled(KERNELS[name], example(pooled=name.startswith("transitions")))
