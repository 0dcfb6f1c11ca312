"""What a browser sends when somebody decides, checked."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Annotated, Any, Final, Literal

import msgspec
import shapely
from msgspec import Meta

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_from_plan
from houseexpo.plan.overrides import MIN_DOOR_M

_BESIDE_M: Final = 2.0
SNAP_M: Final = 0.25
"""A hand's breadth beside a wall: a door that is drawn there is meant in the wall."""
WALL_M: Final = 0.5
"""The thickest wall in which a door is drawn."""
INTO_WALL_M: Final = 0.03
_DIGITS: Final = 3
_CONTROLS: Final = re.compile(r"[\x00-\x1f\x7f]+")

Name = Annotated[str, Meta(min_length=1, max_length=60)]
Id = Annotated[str, Meta(min_length=1, max_length=300)]
Point = tuple[float, float]


class Decision(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A decision; ``points`` are metres in the plan, ``seen`` the number of the latest line that the reviewer knows."""

    plan: Id
    action: Literal["keep", "drop", "door", "no_room", "note"]
    reviewer: Name
    seen: int = 0
    points: Annotated[list[Point], Meta(max_length=2)] = []
    text: Annotated[str, Meta(max_length=500)] = ""


class Begin(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Build again; ``confirm`` stands for the commands that were shown (``Building.status``)."""

    reviewer: Name
    confirm: Annotated[str, Meta(max_length=64)]


class Undo(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Take back the reviewer's latest decision."""

    reviewer: Name


def plain(text: str) -> str:
    """Return words in one line, without what no keyboard types."""
    return _CONTROLS.sub(" ", text).strip()


def value_of(asked: Decision, plan: FloorPlan) -> Any:
    """Return what a decision says beside its action, as ``Decisions`` takes it.

    Raises
    ------
    ConfigError
        It has too few points, points outside of the plan, jambs that are too near, a door that is not in a wall, or the
        plan has no frame.
    """
    if asked.action in {"keep", "drop", "note"}:
        return plain(asked.text)
    wanted = 2 if asked.action == "door" else 1
    if len(asked.points) != wanted:
        raise ConfigError(f"{asked.action}: expected {wanted} points, found {len(asked.points)}")
    _check_inside(asked.points, plan)
    if asked.action == "door" and math.dist(*asked.points) < MIN_DOOR_M:
        found = f"{math.dist(*asked.points):.2f} m"
        raise ConfigError(f"door: expected jambs {MIN_DOOR_M} m apart or more, found {found}; set them anew")
    if plan.frame is None:
        raise ConfigError(f"{plan.id}: it does not say where it stands in its source; only keep and drop are possible")
    drawn = snapped(asked.points, plan) if asked.action == "door" else asked.points
    points = [_rounded(point) for point in source_from_plan(plan.frame, drawn).tolist()]
    return points if asked.action == "door" else points[0]


def snapped(jambs: Sequence[Point], plan: FloorPlan) -> list[Point]:
    """Return a door's jambs, plan metres, moved into the nearest wall within a hand's breadth (``SNAP_M``).

    A door that lies in a wall, or over a door that is there, stays where it was drawn.

    Raises
    ------
    ConfigError
        No wall of a room is that near.
    """
    line = shapely.LineString(jambs)
    middle, space = line.centroid, plan.free_space
    if any(door.polygon.distance(middle) <= SNAP_M for door in plan.doors):
        return list(jambs)
    edge = space.boundary
    far = float(edge.distance(middle))
    if far > (SNAP_M if space.contains(middle) else WALL_M):
        raise ConfigError(
            f"door: expected a place in a wall, found one {far:.2f} m from the nearest wall; draw it on the wall"
        )
    if not space.contains(middle):
        return list(jambs)
    near = shapely.shortest_line(middle, edge).coords[-1]
    dx, dy = near[0] - middle.x, near[1] - middle.y
    scale = (far + INTO_WALL_M) / far if far > 0 else 0.0
    return [(x + scale * dx, y + scale * dy) for x, y in jambs]


def _check_inside(points: Sequence[Point], plan: FloorPlan) -> None:
    x1, y1, x2, y2 = plan.bbox
    for x, y in points:
        if not (x1 - _BESIDE_M <= x <= x2 + _BESIDE_M and y1 - _BESIDE_M <= y <= y2 + _BESIDE_M):
            raise ConfigError(f"point: expected one in the plan, metres, found ({x:g}, {y:g})")


def _rounded(point: Sequence[float]) -> list[float]:
    return [round(value, _DIGITS) + 0.0 for value in point]  # + 0.0: no -0.0
