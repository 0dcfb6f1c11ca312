"""Write a simulated run as a ROS 2 bag, without ROS: an MCAP file that rosbag2 plays and Foxglove opens.

Topics, types, frames and qualities of service are those of ``houseexpo ros``, see ``ros_messages``:

- ``/map`` nav_msgs/OccupancyGrid: the robot's map (``Simulator.map``), in the frame ``map``, which is the plan's;
- ``/scan`` sensor_msgs/LaserScan, in ``base_scan``: infinite if a beam hit nothing, NaN if it was lost;
- ``/odom`` nav_msgs/Odometry: the pose by odometry relative to the start, and the velocity of the step before;
- ``/tf`` tf2_msgs/TFMessage: ``odom`` in ``map``, which is the start, and ``base_footprint`` in ``odom``;
- ``/tf_static`` tf2_msgs/TFMessage, once: ``base_link`` and ``base_scan`` in ``base_footprint``;
- ``/clock`` rosgraph_msgs/Clock.

Stamps of messages are seconds since the start of the episode (``config.step_s`` per step), starting at 1, since some
programs interpret 0 as "now". Each step has a message on each topic.
"""

from __future__ import annotations

import math
import os
import shutil
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.errors import ConfigError, MissingDependencyError, install_command
from houseexpo.files import PARTIAL, make_folder
from houseexpo.pseudoslam.io.poses import Pose, relative_pose
from houseexpo.pseudoslam.io.ros_messages import (
    BASE,
    FIELDS,
    NANOSECONDS,
    RANGE_MIN_M,
    SCAN,
    START_NS,
    TOPICS,
    Fields,
    Message,
    TopicQuality,
    beam_directions,
    clock_message,
    fixed_frames_message,
    laser_scan_message,
    occupancy_grid_message,
    odometry_message,
    transforms_message,
)
from houseexpo.pseudoslam.kernels.sensing.rays import cast_beams
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State

_VERSION: Final = 9  # of the bag format


class BagWriter:
    """A context manager that writes one episode; the file appears when the context ends without an error.

    Parameters
    ----------
    path
        File to write, .mcap.

    Raises
    ------
    ConfigError
        The file has another extension.
    MissingDependencyError
        rosbags is not installed.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._path = Path(path)
        if self._path.suffix != ".mcap":
            raise ConfigError(f"bag: expected a file that ends in .mcap, found {self._path.name!r}")
        try:
            from rosbags import rosbag2
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            said = f"bags need rosbags, which is not installed: {install_command('bag')}"
            raise MissingDependencyError(said) from error
        self._rosbag2, self._types = rosbag2, get_typestore(Stores.ROS2_JAZZY)
        self._start: Pose | None = None
        self._before: tuple[int, Pose] | None = None

    def __enter__(self) -> BagWriter:
        make_folder(self._path.parent)
        self._folder = Path(tempfile.mkdtemp(dir=self._path.parent, prefix=PARTIAL))
        bags = self._rosbag2
        self._writer = bags.Writer(self._folder / "bag", version=_VERSION, storage_plugin=bags.StoragePlugin.MCAP)
        self._writer.set_compression(bags.CompressionMode.STORAGE, bags.CompressionFormat.ZSTD)
        self._writer.open()
        self._topics = {
            name: self._writer.add_connection(
                f"/{name}", topic.kind, typestore=self._types, offered_qos_profiles=[_qos(topic.quality)]
            )
            for name, topic in TOPICS.items()
        }
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._writer.close()
            if kind is None:
                (self._folder / "bag" / "bag.mcap").replace(self._path)
        finally:
            shutil.rmtree(self._folder, ignore_errors=True)

    def write(self, simulator: Simulator, state: State) -> None:
        """Write the robot's map and sensor data; call this at the start of the episode and after each step."""
        now = START_NS + round(float(state.counts.steps) * simulator.config.step_s * NANOSECONDS)
        believed = simulator.believed_pose(state)
        if self._start is None:
            self._start = believed
            self._add("tf_static", now, fixed_frames_message())
        here = relative_pose(self._start, believed)
        self._add("clock", now, clock_message(now))
        self._add("tf", now, transforms_message([(now, "map", "odom", self._start), (now, "odom", BASE, here)]))
        self._add("odom", now, odometry_message(now, "odom", BASE, here, self._speed(now, here)))
        self._add("scan", now, _scan(now, simulator, state))
        self._add("map", now, occupancy_grid_message(now, "map", simulator.map(state)))

    def _speed(self, now: int, here: Pose) -> tuple[float, float, float]:
        """Return the mean velocity since the message before, in the robot's frame then, and the turning."""
        (since, there), self._before = self._before or (now, here), (now, here)
        if now == since:
            return 0.0, 0.0, 0.0
        ahead, left, turned = relative_pose(there, here)
        seconds = (now - since) / NANOSECONDS
        return ahead / seconds, left / seconds, turned / seconds

    def _add(self, name: str, now: int, message: Message) -> None:
        data = self._types.serialize_cdr(self._of(*message), message.type)
        self._writer.write(self._topics[name], now, data)

    def _of(self, kind: str, fields: Fields) -> Any:  # a message of rosbags, whose types have no annotations
        return self._types.types[kind](**{name: self._part(FIELDS[kind][name], part) for name, part in fields.items()})

    def _part(self, kind: str, part: Any) -> Any:  # a field
        if isinstance(part, dict):
            return self._of(kind, part)
        return [self._part(kind.removesuffix("[]"), one) for one in part] if isinstance(part, list) else part


def _qos(quality: TopicQuality) -> Any:
    """Return what rosbag2 offers at playback."""
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

    infinite = QosTime(2147483647, 4294967295)
    durability = QosDurability.TRANSIENT_LOCAL if quality.latched else QosDurability.VOLATILE
    return Qos(
        QosHistory.KEEP_LAST, quality.depth, QosReliability.RELIABLE, durability, infinite, infinite,
        QosLiveliness.AUTOMATIC, infinite, avoid_ros_namespace_conventions=False,
    )  # fmt: skip


def _scan(now: int, simulator: Simulator, state: State) -> Message:
    laser = simulator.config.laser
    return laser_scan_message(
        now, SCAN, _ranges_m(simulator, state), first_rad=float(beam_directions(laser)[0]),
        step_rad=math.radians(laser.resolution_deg), scan_s=simulator.config.step_s, least_m=RANGE_MIN_M,
        most_m=laser.range_m,
    )  # fmt: skip


def _ranges_m(simulator: Simulator, state: State) -> npt.NDArray[np.float32]:
    """Return the ranges (beams,) in metres, with noise if the episode records it, else without."""
    sensor, ppm = simulator.params.sensor, simulator.config.pixels_per_metre
    found = state.episode.ranges
    if not len(found):
        x, y, heading = state.pose_px.tolist()
        found = np.empty(len(sensor.fan_cos))
        cast_beams(state.occupied, x, y, heading, sensor.fan_cos, sensor.fan_sin, sensor.range_px, found)
    ranges = np.where(found >= sensor.range_px, np.inf, found / ppm)
    if simulator.config.noise.drop_out > 0:
        ranges[found == 0.0] = np.nan
    return ranges.astype(np.float32)
