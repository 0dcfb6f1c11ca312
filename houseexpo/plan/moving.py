"""Shift a plan with everything in it; its frame still maps to the same place in the source."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from houseexpo.plan.model import PlanData
from houseexpo.plan.parts import Frame

_Plan = TypeVar("_Plan", bound=PlanData)


def moved(plan: _Plan, dx: float, dy: float) -> _Plan:
    """Return the plan shifted by (dx, dy) metres."""
    by = np.array([dx, dy])
    boxes = {
        label: tuple((x1 + dx, y1 + dy, x2 + dx, y2 + dy) for x1, y1, x2, y2 in found)
        for label, found in plan.room_category.items()
    }
    return replace(
        plan,
        verts=plan.verts + by,
        room_category=boxes,
        holes=tuple(hole + by for hole in plan.holes),
        rooms=tuple(replace(r, ring=r.ring + by, holes=tuple(h + by for h in r.holes)) for r in plan.rooms),
        doors=tuple(
            replace(d, ring=d.ring + by, segment=tuple((x + dx, y + dy) for x, y in d.segment))  # type: ignore[arg-type]
            for d in plan.doors
        ),
        objects=tuple(replace(thing, ring=thing.ring + by) for thing in plan.objects),
        frame=None if plan.frame is None else _moved_frame(plan.frame, dx, dy),
    )


def _moved_frame(frame: Frame, dx: float, dy: float) -> Frame:
    (a, b, tx), (c, d, ty) = frame.matrix
    return replace(frame, matrix=((a, b, tx - a * dx - b * dy), (c, d, ty - c * dx - d * dy)))
