"""Draw a plan's free space in pixels: a PNG, NumPy grids (``.npz``), or a map for ROS map_server (``.pgm``)."""

from __future__ import annotations

import io
import json
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import shapely

from houseexpo.errors import PlanError
from houseexpo.exports.encoding import Files, encode_image, format_number, picture_scale
from houseexpo.exports.placement import ExportFrame, Orientation, orient_plan, pose_in_export, world_from_plan
from houseexpo.exports.plan_bodies import WALL_THICKNESS_M
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import fill_cells, free_mask
from houseexpo.grids.robot_map import WALLS_ONLY

PNG_RESOLUTION_M: Final = 0.02
NPZ_RESOLUTION_M: Final = 0.04
ROS_RESOLUTION_M: Final = 0.05
MAX_NPZ_CELLS: Final = 1 << 27
"""Largest number of cells of ``npz``, whose four grids and their makings take some 30 bytes per cell."""

FREE, WALL, UNKNOWN = 254, 0, 205  # the values that map_server's own map_saver writes


def png(
    plan: FloorPlan,
    *,
    resolution: float = PNG_RESOLUTION_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.png``: 8-bit grey, 255 for free space and 0 elsewhere, with a margin of one pixel.

    The first row is at the highest y. The house is shown as seen from above (mirrored plans are mirrored back).
    ``resolution`` is in metres per pixel. The text ``walls_only`` says that it shows no furniture, and the texts
    ``resolution`` and ``origin`` (x, y and yaw) are those of ``ros_map``. For pictures with rooms and labels, use
    ``houseexpo.draw_plan``.
    """
    mask, cells = free_mask(orient_plan(plan, orientation), picture_scale(plan, resolution), y_up=True)
    pose = pose_in_export(plan, orientation, frame)
    place = [*pose.point(cells.origin_m), pose.yaw]
    text = {WALLS_ONLY: "true", "resolution": repr(float(resolution)), "origin": _as_list(*place)}
    return {f"{plan.id}.png": encode_image(mask.astype(np.uint8) * 255, "PNG", text)}


def npz(
    plan: FloorPlan,
    *,
    resolution: float = NPZ_RESOLUTION_M,
    orientation: Orientation = "plan",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.npz``: grids (rows, cols) on the same cells, row 0 at the lowest y as in ``FloorPlan.grid``.

    - ``occupancy``: uint8, 0 for free cells, 1 for others; ``distance``: float32, metres to the nearest wall;
    - ``rooms``, ``doors``: int32, ids, -1 elsewhere; ``room_ids``, ``room_labels``: the labels of these rooms;
    - ``origin``: (2,) metres, the corner of cell (0, 0) with the lowest x and y; ``resolution``: metres per cell;
    - ``yaw``: radians, by which the grid is turned counter-clockwise about ``origin``;
    - ``world_from_plan``: (2, 3); the plan keeps its own axes unless ``orientation`` is "world".
    """
    turned, scale = orient_plan(plan, orientation), picture_scale(plan, resolution)
    pose = pose_in_export(plan, orientation, frame)
    rows, cols = turned.grid_frame(scale).shape
    if rows * cols > MAX_NPZ_CELLS:
        raise PlanError(
            f"npz: expected at most {MAX_NPZ_CELLS:,} cells, found {rows:,} x {cols:,}; choose a coarser resolution",
            plan=plan.id,
        )
    arrays: dict[str, npt.NDArray[Any]] = {
        "occupancy": turned.grid(scale),
        "distance": turned.distance_field(scale),
        "rooms": turned.room_grid(scale),
        "doors": turned.door_grid(scale),
        "room_ids": np.array([room.id for room in turned.rooms], dtype=np.int32),
        "room_labels": np.array([room.label for room in turned.rooms], dtype=np.str_),
        "origin": np.array(pose.point(turned.grid_frame(scale).origin_m)),
        "yaw": np.array(pose.yaw),
        "resolution": np.array(float(resolution)),
        "world_from_plan": np.array(world_from_plan(plan, orientation, frame)),
    }
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return {f"{plan.id}.npz": stream.getvalue()}


def ros_map(
    plan: FloorPlan,
    *,
    resolution: float = ROS_RESOLUTION_M,
    wall_thickness: float = WALL_THICKNESS_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Files:
    """Write ``<id>.pgm`` and ``<id>.yaml`` for ROS map_server.

    The picture's first row is at the highest y. ``origin`` in the YAML is the lower-left corner of the lower-left
    pixel, x and y in metres, and the yaw of the picture about it (mirrored plans are mirrored back). The plan of a map
    with a yaw gets this yaw again, so that its walls run along rows and columns. The key ``walls_only``, which
    map_server ignores, says whether all that is occupied is wall: the plan has no objects.

    Parameters
    ----------
    plan
        The plan; it is rasterised by pixel centres, so that walls thinner than ``resolution`` may disappear.
    resolution
        Metres per pixel.
    wall_thickness
        Thickness of the outer walls, metres, at least one pixel. The area beyond them is unknown.
    orientation, frame
        See ``houseexpo.exports.placement``.
    """
    pixels, cells = occupancy_picture(plan, resolution, wall_thickness, orientation)
    pose = pose_in_export(plan, orientation, frame)
    origin = (*pose.point(cells.origin_m), pose.yaw)
    return map_server_files(plan.id, pixels, resolution, origin, walls_only=not plan.furniture)


def map_server_files(
    name: str,
    pixels: npt.NDArray[np.uint8],
    resolution: float,
    origin: tuple[float, float, float],
    *,
    walls_only: bool = False,
) -> Files:
    """Return the files of a picture (rows, cols) of FREE, WALL and UNKNOWN, highest y first, and its YAML.

    ``origin`` is (x, y, yaw) of the lower-left corner, metres and radians.
    """
    lines = [
        f"image: {json.dumps(name + '.pgm', ensure_ascii=False)}",  # JSON strings are valid in YAML
        "mode: trinary",
        f"resolution: {float(resolution)!r}",
        f"origin: {_as_list(*origin)}",
        "negate: 0",
        "occupied_thresh: 0.65",
        "free_thresh: 0.196",
        *([f"{WALLS_ONLY}: true"] if walls_only else []),
    ]
    return {f"{name}.pgm": encode_image(pixels, "PPM"), f"{name}.yaml": ("\n".join(lines) + "\n").encode()}


def _as_list(x: float, y: float, yaw: float) -> str:
    return f"[{format_number(x)}, {format_number(y)}, {round(yaw, 9) + 0.0!r}]"


def occupancy_picture(
    plan: FloorPlan, resolution: float, wall_thickness: float, orientation: Orientation
) -> tuple[np.ndarray[tuple[int, int], np.dtype[np.uint8]], GridFrame]:
    """Return the picture (rows, cols) of FREE, WALL and UNKNOWN, highest y first, and its position."""
    scale = picture_scale(plan, resolution)
    turned = orient_plan(plan, orientation)
    walls = shapely.MultiPolygon(turned.walls(max(wall_thickness, resolution)))
    frame = GridFrame.around(walls.bounds, scale, y_up=True)
    pixels = np.full(frame.shape, UNKNOWN, dtype=np.uint8)
    fill_cells(pixels, walls, frame, WALL)
    if turned.objects:
        fill_cells(pixels, turned.floor, frame, WALL)
    fill_cells(pixels, turned, frame, FREE)
    return pixels, frame
