"""Transform a plan's axes to those of a right-handed world seen from above. Only this file handles mirrored plans.

A plan that keeps x = X, y = Z of a y-up source (SUNCG, and therefore every published plan) shows the house mirrored.
Exports for viewers and simulators undo that with this transform::

    (x, y)  ->  (x, y_min + y_max - y)

It preserves the plan's bounds. All other plans are unchanged.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Box, Frame, Ring

Orientation: TypeAlias = Literal["world", "plan"]
Matrix: TypeAlias = tuple[tuple[float, float, float], tuple[float, float, float]]

_DIGITS = 9  # removes the rounding error of the sum from coordinates on the 1 cm grid


def is_mirrored(plan: FloorPlan) -> bool:
    """Return whether the plan shows the house mirrored; a plan without a frame is a published one, which does."""
    if plan.frame is None:
        return True
    (a, b, _), (c, d, _) = plan.frame.matrix
    # plan axes (X, Z) of a y-up source are left-handed seen from above, (X, Y) of a z-up one right-handed
    return (a * d - b * c > 0) == (plan.frame.up == "y")


def world_from_plan(plan: FloorPlan, orientation: Orientation = "world") -> Matrix:
    """Return the matrix (2, 3) that maps plan metres (x, y, 1) to the export's metres.

    Parameters
    ----------
    plan
        A plan in its own axes.
    orientation
        "world": as seen from above in a right-handed world with z up; "plan": the plan's own axes.
    """
    if orientation not in {"world", "plan"}:
        raise ConfigError(f"orientation: expected 'world' or 'plan', found {orientation!r}")
    if orientation == "plan" or not is_mirrored(plan):
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    _, low, _, high = plan.bbox
    return (1.0, 0.0, 0.0), (0.0, -1.0, round(low + high, _DIGITS))


def orient_plan(plan: FloorPlan, orientation: Orientation = "world") -> FloorPlan:
    """Return the plan with ``world_from_plan`` applied to everything in it, including its frame."""
    (_, _, _), (_, sign, shift) = world_from_plan(plan, orientation)
    if sign > 0:
        return plan

    def ring(points: Ring) -> Ring:
        flipped = np.column_stack([points[:, 0], np.round(shift - points[:, 1], _DIGITS)])
        return flipped[::-1]  # mirroring reverses the direction of a ring; this restores it

    def point(x: float, y: float) -> tuple[float, float]:
        return x, round(shift - y, _DIGITS)

    def box(found: Box) -> Box:
        x1, y1, x2, y2 = found
        return (*point(x1, y2), *point(x2, y1))

    return replace(
        plan,
        verts=ring(plan.verts),
        room_category={label: tuple(map(box, boxes)) for label, boxes in plan.room_category.items()},
        holes=tuple(map(ring, plan.holes)),
        rooms=tuple(replace(r, ring=ring(r.ring), holes=tuple(map(ring, r.holes))) for r in plan.rooms),
        doors=tuple(
            replace(d, ring=ring(d.ring), segment=(point(*d.segment[0]), point(*d.segment[1]))) for d in plan.doors
        ),
        objects=tuple(replace(thing, ring=ring(thing.ring)) for thing in plan.objects),
        frame=_flip_frame(plan.frame, shift),
    )


def _flip_frame(frame: Frame | None, shift: float) -> Frame | None:
    """Return the frame of the flipped plan, which still maps to the same place in the source."""
    if frame is None:
        return None
    (a, b, tx), (c, d, ty) = frame.matrix
    return replace(frame, matrix=((a, -b, tx + b * shift), (c, -d, ty + d * shift)))
