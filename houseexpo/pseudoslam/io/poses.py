"""Convert poses (x, y in metres, heading in radians, counter-clockwise from x) to the frame of another and back."""

from __future__ import annotations

import math
from typing import TypeAlias

Pose: TypeAlias = tuple[float, float, float]


def relative_pose(origin: Pose, pose: Pose) -> Pose:
    """Return a pose in the frame of another: metres ahead and to the left, and the angle between the headings.

    Examples
    --------
    >>> relative_pose((1.0, 1.0, 0.0), (3.0, 2.0, 0.5))
    (2.0, 1.0, 0.5)
    """
    x, y, turn = (there - here for there, here in zip(pose, origin, strict=True))
    cos, sin = math.cos(origin[2]), math.sin(origin[2])
    return x * cos + y * sin, y * cos - x * sin, wrap_angle(turn)


def compose_poses(origin: Pose, pose: Pose) -> Pose:
    """Return a pose that is given in the frame of another; the inverse of ``relative_pose``.

    Examples
    --------
    >>> compose_poses((1.0, 1.0, 0.0), (2.0, 1.0, 0.5))
    (3.0, 2.0, 0.5)
    """
    x, y, turn = pose
    cos, sin = math.cos(origin[2]), math.sin(origin[2])
    return origin[0] + x * cos - y * sin, origin[1] + x * sin + y * cos, wrap_angle(origin[2] + turn)


def wrap_angle(angle: float) -> float:
    """Return the same angle in [-pi, pi], radians."""
    return math.remainder(angle, 2.0 * math.pi)
