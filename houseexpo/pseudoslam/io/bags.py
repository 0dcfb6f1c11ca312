"""Write a simulated run as a ROS 2 bag, without ROS: an MCAP file that rosbag2 plays and Foxglove opens.

- ``/map`` nav_msgs/OccupancyGrid: the robot's map (``Simulator.map``), in the frame ``map``, which is the plan's;
- ``/scan`` sensor_msgs/LaserScan, in ``base_link``: infinite if a beam hit nothing, NaN if it was lost;
- ``/odom`` nav_msgs/Odometry: the pose by odometry relative to the start;
- ``/tf`` tf2_msgs/TFMessage: ``odom`` in ``map``, which is the start, and ``base_link`` in ``odom``.

Stamps of messages are seconds since the start of the episode (``config.step_s`` per step), starting at 1, since some
programs interpret 0 as "now".
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

from houseexpo.errors import ConfigError, MissingDependencyError, installing
from houseexpo.files import PARTIAL, make_folder
from houseexpo.pseudoslam.io.poses import Pose, relative
from houseexpo.pseudoslam.kernels.sensing.rays import cast
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State

TOPICS: Final = {
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/scan": "sensor_msgs/msg/LaserScan",
    "/odom": "nav_msgs/msg/Odometry",
    "/tf": "tf2_msgs/msg/TFMessage",
}
_START_S: Final = 1.0
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
            said = f"bags need rosbags, which is not installed: {installing('bag')}"
            raise MissingDependencyError(said) from error
        self._rosbag2, self._types = rosbag2, get_typestore(Stores.ROS2_JAZZY)
        self._start: Pose | None = None

    def __enter__(self) -> BagWriter:
        make_folder(self._path.parent)
        self._folder = Path(tempfile.mkdtemp(dir=self._path.parent, prefix=PARTIAL))
        bags = self._rosbag2
        self._writer = bags.Writer(self._folder / "bag", version=_VERSION, storage_plugin=bags.StoragePlugin.MCAP)
        self._writer.set_compression(bags.CompressionMode.STORAGE, bags.CompressionFormat.ZSTD)
        self._writer.open()
        self._topics = {
            topic: self._writer.add_connection(topic, kind, typestore=self._types) for topic, kind in TOPICS.items()
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
        seconds = _START_S + float(state.counts.steps) * simulator.config.step_s
        believed = simulator.believed_pose(state)
        if self._start is None:
            self._start = believed
        here = relative(self._start, believed)
        moved = [
            self._transform(seconds, "map", "odom", self._start),
            self._transform(seconds, "odom", "base_link", here),
        ]
        messages = {
            "/tf": self._of("TFMessage", "tf2_msgs", transforms=moved),
            "/odom": self._odometry(seconds, here),
            "/scan": self._scan(seconds, simulator, state),
            "/map": self._map(seconds, simulator, state),
        }  # fmt: skip
        for topic, message in messages.items():
            data = self._types.serialize_cdr(message, TOPICS[topic])
            self._writer.write(self._topics[topic], round(seconds * 1e9), data)

    def _of(self, name: str, package: str = "geometry_msgs", **parts: Any) -> Any:
        """Return a message; ROS's types have no type annotations."""
        return self._types.types[f"{package}/msg/{name}"](**parts)

    def _header(self, seconds: float, frame: str) -> Any:
        nanoseconds = round(seconds * 1e9)
        stamp = self._of("Time", "builtin_interfaces", sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
        return self._of("Header", "std_msgs", stamp=stamp, frame_id=frame)

    def _quaternion(self, heading: float) -> Any:
        return self._of("Quaternion", x=0.0, y=0.0, z=math.sin(heading / 2), w=math.cos(heading / 2))

    def _pose(self, pose: Pose) -> Any:
        x, y, heading = pose
        return self._of("Pose", position=self._of("Point", x=x, y=y, z=0.0), orientation=self._quaternion(heading))

    def _transform(self, seconds: float, parent: str, child: str, pose: Pose) -> Any:
        x, y, heading = pose
        moved = self._of("Transform", translation=self._vector(x, y), rotation=self._quaternion(heading))
        return self._of("TransformStamped", header=self._header(seconds, parent), child_frame_id=child, transform=moved)

    def _vector(self, x: float, y: float) -> Any:
        return self._of("Vector3", x=x, y=y, z=0.0)

    def _odometry(self, seconds: float, here: Pose) -> Any:
        """Return the odometry message, without speeds, since the robot moves in steps."""
        unsaid = np.zeros(36)
        still = self._of("Twist", linear=self._vector(0.0, 0.0), angular=self._vector(0.0, 0.0))
        return self._of(
            "Odometry", "nav_msgs", header=self._header(seconds, "odom"), child_frame_id="base_link",
            pose=self._of("PoseWithCovariance", pose=self._pose(here), covariance=unsaid),
            twist=self._of("TwistWithCovariance", twist=still, covariance=unsaid),
        )  # fmt: skip

    def _scan(self, seconds: float, simulator: Simulator, state: State) -> Any:
        laser = simulator.config.laser
        ranges = _ranges_m(simulator, state)
        half, step = math.radians(laser.fov_deg) / 2, math.radians(laser.resolution_deg)
        return self._of(
            "LaserScan", "sensor_msgs", header=self._header(seconds, "base_link"), angle_min=-half,
            angle_max=-half + (len(ranges) - 1) * step, angle_increment=step, time_increment=0.0,
            scan_time=simulator.config.step_s, range_min=0.0, range_max=laser.range_m, ranges=ranges,
            intensities=np.zeros(0, np.float32),
        )  # fmt: skip

    def _map(self, seconds: float, simulator: Simulator, state: State) -> Any:
        grid = simulator.map(state)
        rows, cols = grid.data.shape
        header = self._header(seconds, "map")
        info = self._of(
            "MapMetaData", "nav_msgs", map_load_time=header.stamp, resolution=grid.resolution, width=cols, height=rows,
            origin=self._pose((*grid.origin, 0.0)),
        )  # fmt: skip
        return self._of("OccupancyGrid", "nav_msgs", header=header, info=info, data=grid.data.ravel())


def _ranges_m(simulator: Simulator, state: State) -> npt.NDArray[np.float32]:
    """Return the ranges (beams,) in metres, with noise if the episode records it, else without."""
    sensor, ppm = simulator.params.sensor, simulator.config.pixels_per_metre
    found = state.episode.ranges
    if not len(found):
        x, y, heading = state.pose_px.tolist()
        found = np.empty(len(sensor.fan_cos))
        cast(state.occupied, x, y, heading, sensor.fan_cos, sensor.fan_sin, sensor.range_px, found)
    ranges = np.where(found >= sensor.range_px, np.inf, found / ppm)
    if simulator.config.noise.drop_out > 0:
        ranges[found == 0.0] = np.nan
    return ranges.astype(np.float32)
