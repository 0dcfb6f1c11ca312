"""Make ROS 2 messages as plain values from poses, scans and maps; bags and DDS networks carry them.

A message is a ``Message``: the name of its ROS type and its fields, nested dictionaries of numbers, text and arrays.
``FIELDS`` names the fields of each type in their order, as the interface packages of ROS 2 define them; a carrier turns
them into the types of its library.

``TOPICS`` are a robot's topics, with types and qualities of service. ``map`` is the plan's frame, ``odom`` the one in
which the robot starts. A robot's frame is ``base_footprint``, on which ``base_link`` and the laser's ``base_scan`` lie.

Times are nanoseconds, lengths metres, angles radians.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from houseexpo.grids.robot_map import yaw_from_quaternion
from houseexpo.pseudoslam.config import LaserConfig
from houseexpo.pseudoslam.io.poses import Pose
from houseexpo.pseudoslam.simulator import OccupancyGrid

Fields: TypeAlias = dict[str, Any]


class Message(NamedTuple):
    """The name of a ROS type, such as ``sensor_msgs/msg/LaserScan``, and the fields of a message."""

    type: str
    fields: Fields


_NOTHING: Final = {"structure_needs_at_least_one_member": "uint8"}
"""The fields of a type without fields, as ROS 2 writes them."""
FIELDS: Final[dict[str, dict[str, str]]] = {
    "builtin_interfaces/msg/Time": {"sec": "int32", "nanosec": "uint32"},
    "std_msgs/msg/Header": {"stamp": "builtin_interfaces/msg/Time", "frame_id": "string"},
    "std_msgs/msg/Empty": _NOTHING,
    "std_msgs/msg/String": {"data": "string"},
    "std_msgs/msg/UInt32": {"data": "uint32"},
    "geometry_msgs/msg/Vector3": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/msg/Point": {"x": "float64", "y": "float64", "z": "float64"},
    "geometry_msgs/msg/Quaternion": {"x": "float64", "y": "float64", "z": "float64", "w": "float64"},
    "geometry_msgs/msg/Pose": {"position": "geometry_msgs/msg/Point", "orientation": "geometry_msgs/msg/Quaternion"},
    "geometry_msgs/msg/PoseWithCovariance": {"pose": "geometry_msgs/msg/Pose", "covariance": "float64[36]"},
    "geometry_msgs/msg/PoseWithCovarianceStamped": {
        "header": "std_msgs/msg/Header",
        "pose": "geometry_msgs/msg/PoseWithCovariance",
    },
    "geometry_msgs/msg/Twist": {"linear": "geometry_msgs/msg/Vector3", "angular": "geometry_msgs/msg/Vector3"},
    "geometry_msgs/msg/TwistStamped": {"header": "std_msgs/msg/Header", "twist": "geometry_msgs/msg/Twist"},
    "geometry_msgs/msg/TwistWithCovariance": {"twist": "geometry_msgs/msg/Twist", "covariance": "float64[36]"},
    "geometry_msgs/msg/Transform": {
        "translation": "geometry_msgs/msg/Vector3",
        "rotation": "geometry_msgs/msg/Quaternion",
    },
    "geometry_msgs/msg/TransformStamped": {
        "header": "std_msgs/msg/Header",
        "child_frame_id": "string",
        "transform": "geometry_msgs/msg/Transform",
    },
    "tf2_msgs/msg/TFMessage": {"transforms": "geometry_msgs/msg/TransformStamped[]"},
    "rosgraph_msgs/msg/Clock": {"clock": "builtin_interfaces/msg/Time"},
    "nav_msgs/msg/Odometry": {
        "header": "std_msgs/msg/Header",
        "child_frame_id": "string",
        "pose": "geometry_msgs/msg/PoseWithCovariance",
        "twist": "geometry_msgs/msg/TwistWithCovariance",
    },
    "sensor_msgs/msg/LaserScan": {
        "header": "std_msgs/msg/Header",
        "angle_min": "float32",
        "angle_max": "float32",
        "angle_increment": "float32",
        "time_increment": "float32",
        "scan_time": "float32",
        "range_min": "float32",
        "range_max": "float32",
        "ranges": "float32[]",
        "intensities": "float32[]",
    },
    "nav_msgs/msg/MapMetaData": {
        "map_load_time": "builtin_interfaces/msg/Time",
        "resolution": "float32",
        "width": "uint32",
        "height": "uint32",
        "origin": "geometry_msgs/msg/Pose",
    },
    "nav_msgs/msg/OccupancyGrid": {
        "header": "std_msgs/msg/Header",
        "info": "nav_msgs/msg/MapMetaData",
        "data": "int8[]",
    },
}
"""The types of the fields: a number, ``bool``, ``string``, the name of another type, or one of them with ``[]`` or
``[36]``."""

NANOSECONDS: Final = 1_000_000_000


def time_fields(nanoseconds: int) -> Fields:
    """Return the fields of a ``builtin_interfaces/msg/Time``."""
    return {"sec": nanoseconds // NANOSECONDS, "nanosec": nanoseconds % NANOSECONDS}


def clock_message(nanoseconds: int) -> Message:
    """Return the message of the simulated clock."""
    return Message("rosgraph_msgs/msg/Clock", {"clock": time_fields(nanoseconds)})


def transforms_message(parts: Sequence[tuple[int, str, str, Pose]]) -> Message:
    """Return a message of ``/tf``; each part is (nanoseconds, parent frame, child frame, pose of the child)."""
    return Message(
        "tf2_msgs/msg/TFMessage",
        {
            "transforms": [
                {
                    "header": _header(nanoseconds, parent),
                    "child_frame_id": child,
                    "transform": {"translation": _xyz(x, y), "rotation": _quaternion(heading)},
                }
                for nanoseconds, parent, child, (x, y, heading) in parts
            ]
        },
    )


def odometry_message(
    nanoseconds: int, frame: str, child: str, pose: Pose, speed: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> Message:
    """Return a ``nav_msgs/msg/Odometry``; ``speed`` is ahead and to the left, m/s, and the turning, rad/s."""
    ahead, left, turning = speed
    unknown = np.zeros(36)
    return Message(
        "nav_msgs/msg/Odometry",
        {
            "header": _header(nanoseconds, frame),
            "child_frame_id": child,
            "pose": {"pose": _pose(pose), "covariance": unknown},
            "twist": {"twist": _twist(ahead, left, turning), "covariance": unknown},
        },
    )


def velocity_message(nanoseconds: int, frame: str, kind: str, speed: tuple[float, float, float]) -> Message:
    """Return a velocity of ``odometry_message``, as a Twist or a TwistStamped, whichever ``kind`` names."""
    twist = _twist(*speed)
    return Message(kind, twist if kind.endswith("/Twist") else {"header": _header(nanoseconds, frame), "twist": twist})


def laser_scan_message(
    nanoseconds: int,
    frame: str,
    ranges: npt.NDArray[np.float32],
    *,
    first_rad: float,
    step_rad: float,
    scan_s: float,
    least_m: float,
    most_m: float,
) -> Message:
    """Return a ``sensor_msgs/msg/LaserScan``.

    Parameters
    ----------
    ranges
        (beams,) float32, metres; infinite where a beam hit nothing, NaN where it was lost.
    first_rad, step_rad
        Direction of the first beam relative to ``frame``, and the angle between two beams.
    scan_s
        Time between two scans, seconds.
    least_m, most_m
        The shortest and the longest range that the laser measures.
    """
    return Message(
        "sensor_msgs/msg/LaserScan",
        {
            "header": _header(nanoseconds, frame),
            "angle_min": first_rad,
            "angle_max": first_rad + (len(ranges) - 1) * step_rad,
            "angle_increment": step_rad,
            "time_increment": 0.0,
            "scan_time": scan_s,
            "range_min": least_m,
            "range_max": most_m,
            "ranges": ranges,
            "intensities": np.zeros(0, np.float32),
        },
    )


def occupancy_grid_message(nanoseconds: int, frame: str, grid: OccupancyGrid) -> Message:
    """Return a ``nav_msgs/msg/OccupancyGrid`` of a robot's map."""
    rows, cols = grid.data.shape
    return Message(
        "nav_msgs/msg/OccupancyGrid",
        {
            "header": _header(nanoseconds, frame),
            "info": {
                "map_load_time": time_fields(nanoseconds),
                "resolution": grid.resolution,
                "width": cols,
                "height": rows,
                "origin": _pose((*grid.origin, 0.0)),
            },
            "data": grid.data.ravel(),
        },
    )


def heading_from_quaternion(quaternion: Fields) -> float:
    """Return the heading of a rotation about the vertical axis, radians; of any other, its yaw."""
    return yaw_from_quaternion(*(float(quaternion[name]) for name in "xyzw"))


def _header(nanoseconds: int, frame: str) -> Fields:
    return {"stamp": time_fields(nanoseconds), "frame_id": frame}


def _xyz(x: float, y: float, z: float = 0.0) -> Fields:
    return {"x": x, "y": y, "z": z}


def _twist(x: float, y: float, turning: float) -> Fields:
    return {"linear": _xyz(x, y), "angular": _xyz(0.0, 0.0, turning)}


def _quaternion(heading: float) -> Fields:
    return {**_xyz(0.0, 0.0, math.sin(heading / 2)), "w": math.cos(heading / 2)}


def _pose(pose: Pose) -> Fields:
    x, y, heading = pose
    return {"position": _xyz(x, y), "orientation": _quaternion(heading)}


Floats: TypeAlias = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TopicQuality:
    """The quality of service of a topic: how many messages are kept, and whether late subscribers get the last ones.

    All topics are reliable, since a reliable publisher also serves subscribers that ask for less.
    """

    depth: int = 10
    latched: bool = False


@dataclass(frozen=True)
class Topic:
    """The ROS type of a topic and its quality of service."""

    kind: str
    quality: TopicQuality = TopicQuality()


TOPICS: Final = {
    "clock": Topic("rosgraph_msgs/msg/Clock"),
    "tf": Topic("tf2_msgs/msg/TFMessage", TopicQuality(100)),
    "tf_static": Topic("tf2_msgs/msg/TFMessage", TopicQuality(1, latched=True)),
    "odom": Topic("nav_msgs/msg/Odometry"),
    "scan": Topic("sensor_msgs/msg/LaserScan", TopicQuality(5)),
    "map": Topic("nav_msgs/msg/OccupancyGrid", TopicQuality(1, latched=True)),
}
BASE: Final = "base_footprint"
SCAN: Final = "base_scan"
START_NS: Final = NANOSECONDS
"""The clock's start: programs take a time of 0 for "unknown"."""
RANGE_MIN_M: Final = 0.05
"""The shortest range of a scan."""


def fixed_frames_message(base: str = BASE, scan: str = SCAN) -> Message:
    """Return the message of ``tf_static``: ``base_link`` and the laser's frame, both at the robot's."""
    names: Sequence[str] = [name for name in dict.fromkeys(["base_link", scan]) if name != base]
    return transforms_message([(START_NS, base, name, (0.0, 0.0, 0.0)) for name in names])


def beam_directions(laser: LaserConfig) -> Floats:
    """Return the directions (beams,) of a laser's beams, radians, from right to left, as the simulator casts them."""
    half = math.radians(laser.fov_deg) / 2
    return np.arange(-half, half, math.radians(laser.resolution_deg))
