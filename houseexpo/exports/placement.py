"""Place a plan in the axes of an export: mirrored back or not, in its source's frame or in its own frame.

Only this file knows the transform from a plan's coordinates to an export's. ``orient_plan`` mirrors a plan back if
necessary and keeps it near the origin, where shapes are made, cut and rounded. ``pose_in_export`` returns the pose of
that plan in the export. A format applies this ``Pose`` to the coordinates that it writes, or writes it as the pose of a
grid, a node or a model.

A plan that keeps x = X, y = Z of a y-up source (SUNCG, and therefore every published plan) shows the house mirrored.
Exports for viewers and simulators undo that (``Orientation``). In the plan's own frame, they do so by this transform,
which preserves the plan's bounds::

    (x, y)  ->  (x, y_min + y_max - y)

The source's frame is given by ``plan.frame``, in metres, right-handed and with z up: (X, Y), or (X, -Z) for a source
with y up.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from houseexpo.errors import ConfigError, PlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Box, Door, Frame, Ring

Orientation: TypeAlias = Literal["world", "plan"]
ExportFrame: TypeAlias = Literal["source", "plan"]
Matrix: TypeAlias = tuple[tuple[float, float, float], tuple[float, float, float]]

AnyGeometry = TypeVar("AnyGeometry", bound=BaseGeometry)

MODELS: Final = frozenset({"3d-front", "ifc", "mesh", "procthor", "suncg", "sweethome"})
"""Sources, by their word in the provenance, whose plans are exported in their own frame by default.

The author of a model chooses its origin, height and axes, which are often far away. In the axes of a robot's map, a
drawing, a scan or a simulator's world, people note goals, zones and measured points.
"""
LEFT_HANDED: Final = frozenset({"procthor", "sweethome"})
"""Sources, by their word in the provenance, whose axes are left-handed: Unity's, and x, y down and the height."""
_PLACED_DIGITS = 9  # removes the rounding error of the sum from coordinates on the 1 cm grid
_RIGID: Final = 1e-6
"""A frame changes a plan's size or shape if its axes deviate from unit length or a right angle by more than this."""


@dataclass(frozen=True)
class Pose:
    """The pose of an oriented plan in an export: x, y, z of its origin, metres; yaw, counter-clockwise."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0

    def __bool__(self) -> bool:
        """Whether the pose is not the identity."""
        return any((self.x, self.y, self.z, self.yaw))

    def points(self, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Convert points (..., 2) of the oriented plan to points of the export, metres."""
        given: npt.NDArray[np.float64] = np.asarray(points, np.float64)
        return np.round(given @ self._turn.T + (self.x, self.y), _PLACED_DIGITS) + 0.0 if self else given

    def point(self, at: Sequence[float]) -> tuple[float, float]:
        """Convert one point, like ``points``."""
        x, y = self.points(at).tolist()
        return x, y

    def shape(self, shape: AnyGeometry) -> AnyGeometry:
        """Return a shape in the export's axes."""
        moved: AnyGeometry = shapely.transform(shape, self.points) if self else shape
        return moved

    def to(self, other: Pose) -> Pose:
        """Return this pose relative to another pose."""
        x, y = (np.array([self.x - other.x, self.y - other.y]) @ other._turn).tolist()
        return Pose(x, y, self.z - other.z, self.yaw - other.yaw)

    @property
    def _turn(self) -> npt.NDArray[np.float64]:
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.array([[cos, -sin], [sin, cos]])


def default_frame(plan: FloorPlan) -> ExportFrame:
    """Return the default frame of a plan's exports.

    It is "source" if the plan names the file that it was made of and that file is not a model of a house (MODELS).
    """
    said = plan.provenance or {}
    return "source" if plan.frame is not None and "file" in said and said.get("source") not in MODELS else "plan"


def is_mirrored(plan: FloorPlan) -> bool:
    """Return whether the plan shows the house mirrored; a plan without a frame is published, and therefore mirrored."""
    if plan.frame is None:
        return True
    (a, b, _), (c, d, _) = plan.frame.matrix
    return (a * d - b * c > 0) == _turns_clockwise(plan, plan.frame)


def _turns_clockwise(plan: FloorPlan, frame: Frame) -> bool:
    """Return whether the source's plan axes turn clockwise, seen from above: (X, Z) with y up, in right-handed axes."""
    return (frame.up == "y") != ((plan.provenance or {}).get("source") in LEFT_HANDED)


def world_from_plan(plan: FloorPlan, orientation: Orientation = "world", frame: ExportFrame | None = "plan") -> Matrix:
    """Return the matrix (2, 3) that maps plan metres (x, y, 1) to the export's metres.

    Parameters
    ----------
    plan
        A plan in its own axes.
    orientation
        "world": as seen from above in a right-handed world with z up; "plan": as in the plan, mirrored or not.
    frame
        "source": the frame of the plan's file; "plan": the plan's own frame, which starts at its corner; None:
        ``default_frame``.

    Raises
    ------
    ConfigError
        ``orientation`` or ``frame`` has another value.
    PlanError
        The source's frame is requested, but the plan does not record it, or it changes the plan's size.
    """
    if orientation not in {"world", "plan"}:
        raise ConfigError(f"orientation: expected 'world' or 'plan', found {orientation!r}")
    if frame not in {"source", "plan", None}:
        raise ConfigError(f"frame: expected 'source' or 'plan', found {frame!r}")
    if (frame or default_frame(plan)) == "source":
        return _world_from_source(plan, orientation)
    if orientation == "plan" or not is_mirrored(plan):
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    _, low, _, high = plan.bbox
    return (1.0, 0.0, 0.0), (0.0, -1.0, round(low + high, _PLACED_DIGITS))


def _world_from_source(plan: FloorPlan, orientation: Orientation) -> Matrix:
    if plan.frame is None:
        raise PlanError(
            "expected a plan that knows its place in a source, found none; use the plan's frame", "frame", plan.id
        )
    (a, b, x), (c, d, y) = plan.frame.matrix
    if max(abs(a * a + c * c - 1), abs(b * b + d * d - 1), abs(a * b + c * d)) > _RIGID:
        found = f"({a:g}, {b:g}), ({c:g}, {d:g})"
        raise PlanError(
            f"expected axes of 1 m at right angles to export to the source's frame, found {found}", "frame", plan.id
        )
    if _turns_clockwise(plan, plan.frame) != (orientation == "plan" and is_mirrored(plan)):
        c, d, y = 0.0 - c, 0.0 - d, 0.0 - y
    return (a, b, x), (c, d, y)


def pose_in_export(plan: FloorPlan, orientation: Orientation = "world", frame: ExportFrame | None = None) -> Pose:
    """Return the pose of ``orient_plan(plan, orientation)`` in the export; its z, the floor, is 0 in the plan's frame.

    The errors are those of ``world_from_plan``.
    """
    (_, _, _), (_, sign, shift) = world_from_plan(plan, orientation)
    (a, b, x), (c, d, y) = world_from_plan(plan, orientation, frame)
    b, d = b * sign, d * sign
    is_source = plan.frame is not None and (frame or default_frame(plan)) == "source"
    z = plan.frame.floor if plan.frame is not None and is_source else 0.0
    return Pose(
        round(x - b * shift, _PLACED_DIGITS) + 0.0, round(y - d * shift, _PLACED_DIGITS) + 0.0, z, math.atan2(c, a)
    )


def orient_plan(plan: FloorPlan, orientation: Orientation = "world") -> FloorPlan:
    """Return the plan with ``world_from_plan`` of its own frame applied to everything in it, including its frame."""
    (_, _, _), (_, sign, shift) = world_from_plan(plan, orientation)
    if sign > 0:
        return plan

    def ring(points: Ring) -> Ring:
        flipped = np.column_stack([points[:, 0], np.round(shift - points[:, 1], _PLACED_DIGITS)])
        return flipped[::-1]  # mirroring reverses the direction of a ring; this restores it

    def point(x: float, y: float) -> tuple[float, float]:
        return x, round(shift - y, _PLACED_DIGITS)

    def hole(of: Door) -> Door:
        return replace(of, ring=ring(of.ring), segment=(point(*of.segment[0]), point(*of.segment[1])))

    def box(found: Box) -> Box:
        x1, y1, x2, y2 = found
        return (*point(x1, y2), *point(x2, y1))

    return replace(
        plan,
        verts=ring(plan.verts),
        room_category={label: tuple(map(box, boxes)) for label, boxes in plan.room_category.items()},
        holes=tuple(map(ring, plan.holes)),
        rooms=tuple(replace(r, ring=ring(r.ring), holes=tuple(map(ring, r.holes))) for r in plan.rooms),
        doors=tuple(map(hole, plan.doors)),
        windows=tuple(map(hole, plan.windows)),
        objects=tuple(replace(thing, ring=ring(thing.ring)) for thing in plan.objects),
        frame=_flip_frame(plan.frame, shift),
    )


def _flip_frame(frame: Frame | None, shift: float) -> Frame | None:
    """Return the frame of the flipped plan, which still maps to the same place in the source."""
    if frame is None:
        return None
    (a, b, tx), (c, d, ty) = frame.matrix
    return replace(frame, matrix=((a, -b, tx + b * shift), (c, -d, ty + d * shift)))
