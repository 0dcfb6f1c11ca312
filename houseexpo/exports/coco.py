"""Convert plans to a COCO data set: a grey picture of each plan, and rooms and doors as labelled instances in JSON."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely

from houseexpo.exports.encoding import compact_json, encode_image, picture_scale
from houseexpo.exports.placement import ExportFrame, Orientation, orient_plan, pose_in_export
from houseexpo.exports.polygons import join_holes_by_slits
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import free_mask
from houseexpo.plan import DOOR_KINDS
from houseexpo.plan.room_labels import LABELS, UNLABELLED

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

RESOLUTION_M = 0.04
MARGIN_PX = 8

_NAMES: Final = [("room", label) for label in (*LABELS, UNLABELLED)] + [("door", kind) for kind in DOOR_KINDS]
CATEGORIES: Final = [{"id": i, "name": name, "supercategory": of} for i, (of, name) in enumerate(_NAMES, start=1)]
_CATEGORY_ID: Final = {name: i for i, (_, name) in enumerate(_NAMES, start=1)}


def coco(
    plans: Iterable[FloorPlan],
    *,
    resolution: float = RESOLUTION_M,
    orientation: Orientation = "world",
    frame: ExportFrame | None = None,
) -> Iterator[tuple[str, bytes]]:
    """Write ``images/<id>.png`` for each plan, and ``annotations.json`` last.

    Pictures are 8-bit grey, 255 for free space and 0 elsewhere, with the first row at the highest y. The house is shown
    as seen from above (mirrored plans are mirrored back). ``resolution`` is in metres per pixel. The ``origin`` of an
    image is the lower-left corner of its lower-left pixel in metres, and ``yaw``, in radians, turns the image about it,
    counter-clockwise. Categories are the 25 labels, "Unlabelled", and
    the kinds of doors, the last of which is "window".

    Segmentations are polygons in pixels. COCO's polygons cannot have holes, so that a hole is joined to its outline by
    a slit of 1 cm. For a plan without rooms (a published one), the instances are its label boxes, clipped to the free
    space, with ``source`` "box".
    """
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for number, plan in enumerate(plans, start=1):
        turned = orient_plan(plan, orientation)
        cells = GridFrame.around(_bounds(turned), picture_scale(plan, resolution), margin_px=MARGIN_PX, y_up=True)
        name = f"{plan.id}.png"
        (rows, cols), pose = cells.shape, pose_in_export(plan, orientation, frame)
        x, y = pose.point(cells.origin_m)
        images.append({"id": number, "file_name": name, "width": cols, "height": rows, "plan": plan.id})
        images[-1] |= {"origin": [round(x, 6), round(y, 6)], "yaw": round(pose.yaw, 9), "resolution": resolution}
        for instance in _instances(turned, cells):
            annotations.append({"id": len(annotations) + 1, "image_id": number, "iscrowd": 0, **instance})
        mask, _ = free_mask(turned, frame=cells)
        yield f"images/{name}", encode_image(mask.astype(np.uint8) * 255, "PNG")
    info = {"description": "HouseExpo floor plans: rooms and doors", "version": "1.0"}
    yield (
        "annotations.json",
        compact_json(
            {
                "info": info,
                "licenses": [],
                "images": images,
                "categories": CATEGORIES,
                "annotations": annotations,
            }
        ),
    )


def _instances(plan: FloorPlan, frame: GridFrame) -> Iterator[dict[str, Any]]:
    for room in plan.rooms:
        yield _instance(room.polygon, room.label, frame) | {"room": room.id}
    for door in plan.doors:
        yield _instance(door.polygon, door.kind, frame) | {"door": door.id}
    for window in plan.windows:
        yield _instance(window.polygon, window.kind, frame) | {"window": window.id}
    if plan.rooms:
        return
    for label, boxes in plan.room_category.items():
        for box in boxes:
            inside = shapely.intersection(shapely.box(*box), plan.free_space)
            if inside.area > 0 and label in _CATEGORY_ID:
                yield _instance(inside, label, frame) | {"source": "box"}


def _instance(shape: BaseGeometry, label: str, frame: GridFrame) -> dict[str, Any]:
    whole = [join_holes_by_slits(part) for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    rings = [frame.pixels_from_points(shapely.get_coordinates(part)[:-1]).round(2) for part in whole]
    corners = np.concatenate(rings)
    (x1, y1), (x2, y2) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return {
        "category_id": _CATEGORY_ID[label],
        "segmentation": [ring.ravel().tolist() for ring in rings],
        "bbox": [x1, y1, round(x2 - x1, 2), round(y2 - y1, 2)],
        "area": round(shape.area * frame.pixels_per_metre**2, 2),
    }


def _bounds(plan: FloorPlan) -> list[float]:
    """Return the bounds of the free space and of doors and windows, since these lie in the outer walls."""
    holes = [hole.polygon for hole in (*plan.doors, *plan.windows)]
    bounds: list[float] = shapely.total_bounds([plan.free_space, *holes]).tolist()
    return bounds
