"""Grids as NumPy arrays."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError
from houseexpo.exports.files import Files
from houseexpo.exports.orientation import Orientation, oriented, world_from_plan
from houseexpo.floorplan import FloorPlan

RESOLUTION_M = 0.04


def npz(plan: FloorPlan, *, resolution: float = RESOLUTION_M, orientation: Orientation = "plan") -> Files:
    """Write ``<id>.npz``: grids (rows, cols) on the same cells, row 0 at the lowest y as in ``FloorPlan.grid``.

    - ``occupancy``: uint8, 0 for free cells, 1 for others; ``distance``: float32, metres to the nearest wall;
    - ``rooms``, ``doors``: int32, ids, -1 elsewhere; ``room_ids``, ``room_labels``: the labels of these rooms;
    - ``origin``: (2,) metres, the corner of cell (0, 0) with the lowest x and y; ``resolution``: metres per cell;
    - ``world_from_plan``: (2, 3); the plan keeps its own axes unless ``orientation`` is "world".
    """
    if not resolution > 0:
        raise ConfigError(f"export: expected a resolution of more than 0 m a cell, found {resolution!r}")
    turned, scale = oriented(plan, orientation), 1.0 / resolution
    arrays: dict[str, npt.NDArray[Any]] = {
        "occupancy": turned.grid(scale),
        "distance": turned.distance_field(scale),
        "rooms": turned.room_grid(scale),
        "doors": turned.door_grid(scale),
        "room_ids": np.array([room.id for room in turned.rooms], dtype=np.int32),
        "room_labels": np.array([room.label for room in turned.rooms], dtype=np.str_),
        "origin": np.array(turned.grid_frame(scale).origin_m),
        "resolution": np.array(float(resolution)),
        "world_from_plan": np.array(world_from_plan(plan, orientation)),
    }
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return {f"{plan.id}.npz": stream.getvalue()}
