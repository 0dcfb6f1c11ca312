"""Poses of SDF: numbers to 4 x 4 matrices, and the frames that they are relative to.

R1  A pose is x y z roll pitch yaw (metres, radians; ``degrees`` says otherwise), or x y z and a quaternion x y z w.
R2  It is relative to the frame that it names (``relative_to``; ``frame`` in SDF 1.5 and 1.6), else to what contains it;
    a ``frame`` without a name for its pose is relative to what it is attached to.
R3  A name with ``::`` is looked up in the model of that name.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pipeline.rejection import Reason, Rejection
from pipeline.sources.xml_tree import Element

Matrix = npt.NDArray[np.float64]
_ADVICE = "correct it, or leave the model out"
_OWN = frozenset({"", "__model__", "world", "__root__"})


def numbers(text: str | None, count: int, what: str) -> list[float]:
    """Return the numbers of a text; raise Rejection if they are not ``count`` finite ones."""
    parts = (text or "").split()
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = []
    if len(values) != count or not all(math.isfinite(value) and abs(value) < 1e6 for value in values):
        detail = f"{what}: expected {count} finite numbers, found {' '.join(parts)[:80]!r}"
        raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
    return values


def matrix_of(pose: Element | None, what: str) -> Matrix:
    """R1; the identity where there is no pose."""
    if pose is None or not (pose.text or "").split():
        return np.eye(4)
    quaternion = pose.get("rotation_format") == "quat_xyzw"
    values = numbers(pose.text, 7 if quaternion else 6, f"pose of {what}")
    matrix = np.eye(4)
    if quaternion:
        matrix[:3, :3] = _from_quaternion(values[3:], what)
    else:
        degrees = pose.get("degrees", "false").strip().lower() in {"true", "1"}
        matrix[:3, :3] = _from_angles([math.radians(v) if degrees else v for v in values[3:]])
    matrix[:3, 3] = values[:3]
    return matrix


class Frames:
    """The frames of one model: its links, frames, joints and inner models, each at a place in the model."""

    def __init__(self, model: Element, name: str) -> None:
        self._name = name
        self._found: dict[str, Element] = {}
        for child in model:
            if child.tag in {"link", "frame", "model", "joint", "include"} and child.get("name"):
                self._found.setdefault(str(child.get("name")), child)

    def pose(self, element: Element, asked: tuple[str, ...] = ()) -> Matrix:
        """R2: the place in the model of something that it contains."""
        pose = element.find("pose")
        what = f"{element.tag} {element.get('name', '')!r} of {self._name}"
        base = (pose.get("relative_to") or pose.get("frame") or "") if pose is not None else ""
        if not base:
            base = {"frame": element.get("attached_to", ""), "joint": element.findtext("child", "")}.get(
                element.tag, ""
            )
        return self.at(base.strip(), asked) @ matrix_of(pose, what)

    def at(self, name: str, asked: tuple[str, ...] = ()) -> Matrix:
        """Return a named frame's place in the model."""
        first, _, rest = name.partition("::")
        if first in _OWN:
            return np.eye(4)
        if name in asked:
            detail = f"{self._name}: frame {name!r} is relative to itself"
            raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
        element = self._found.get(first)
        if element is None:
            detail = f"{self._name}: expected a frame {name!r}, found none of that name"
            raise Rejection("source", Reason.UNREADABLE, detail, _ADVICE)
        here = self.pose(element, (*asked, name))
        return here @ Frames(element, first).at(rest) if rest and element.tag == "model" else here  # R3


def placed(model: Element, pose: Matrix, name: str) -> Matrix:
    """Return where a model's own frame is, given the pose of its placement frame."""
    frame = (model.get("placement_frame") or "").strip()
    return pose @ np.linalg.inv(Frames(model, name).at(frame)) if frame else pose


def _from_angles(angles: list[float]) -> Matrix:
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles), np.sin(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _from_quaternion(values: list[float], what: str) -> Matrix:
    length = math.hypot(*values)
    if length < 1e-9:
        raise Rejection("source", Reason.UNREADABLE, f"pose of {what}: a quaternion of length 0", _ADVICE)
    x, y, z, w = (value / length for value in values)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
