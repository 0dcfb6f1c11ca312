"""Define a simulated robot's ROS topics, with types and qualities of service, its frames and beams' directions.

``map`` is the plan's frame, ``odom`` the one in which the robot starts. A robot's frame is ``base_footprint``, on which
``base_link`` and the laser's ``base_scan`` lie.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from houseexpo.pseudoslam.config import LaserConfig
from houseexpo.pseudoslam.io.ros_messages import NANOSECONDS, Message, transforms_message

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
