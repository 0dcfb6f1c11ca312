"""``python -m houseexpo.pseudoslam.compile_step KERNEL``: compile the kernel of a step to disk (see ``ahead``)."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.motion.bodies import no_tracks
from houseexpo.pseudoslam.kernels.planning.distance_field import no_field
from houseexpo.pseudoslam.kernels.planning.flow import no_flow
from houseexpo.pseudoslam.state import State, new_episode
from houseexpo.pseudoslam.step_kernels import arguments_of, entry_point, kernel_named
from houseexpo.pseudoslam.step_params import scratch_of, step_params_of
from houseexpo.pseudoslam.worlds.people import new_bodies


def example() -> tuple[Any, ...]:
    """Return example arguments of step kernels, which are compiled for types of arrays, not for their lengths."""
    raster, config = np.zeros((1, 1), np.uint8), SimulatorConfig()
    moving = new_bodies(0, 0), no_tracks(), no_flow(), no_field()
    episode = new_episode((raster, raster, raster), (0, 0, 0), np.zeros(3), moving, key=0, best_px=0.0)
    return arguments_of(State(episode, 0), 0.0, 0.0, step_params_of(config), scratch_of(config))


if __name__ == "__main__":
    entry_point(kernel_named(sys.argv[1]), *example())
