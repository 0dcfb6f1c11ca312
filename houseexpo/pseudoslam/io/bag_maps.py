"""Read a robot's ROS 2 bag, and return the occupancy map of its laser scans at the poses of its transforms.

The bag may come from a real robot, from Gazebo, or from ``houseexpo record --bag`` and ``houseexpo ros``.

R1  The scans are those of the one topic of type ``sensor_msgs/LaserScan``, or of the topic that is named.
R2  A scan is taken at its stamp from where the transforms put its frame, interpolated between two of them, in the frame
    that no transform places (usually ``map``, else ``odom``). Transforms count as level: x, y and the turn about z.
    Scans before the first and after the last transform are left out.
R3  In each scan, a cell in which a beam ends is hit, and the other cells along the beams are passed. A cell is occupied
    if at least ``HIT`` of the scans that saw it hit it, and else free. Cells that no scan saw are unknown.
R4  A range that is infinite or at least ``range_max`` passes cells up to ``range_max`` and hits none. A range that is
    not a number or below ``range_min`` says nothing.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.grids.frame import FEWEST_CELLS
from houseexpo.grids.robot_map import MAX_MAP_CELLS, MapError, RobotMap, open_bag, yaw_from_quaternion
from houseexpo.pseudoslam.io.poses import Pose, compose_poses, wrap_angle

SCAN_TYPE: Final = "sensor_msgs/msg/LaserScan"
TF_TYPE: Final = "tf2_msgs/msg/TFMessage"
HIT: Final = 0.25
FARTHEST_BEAM_M: Final = 100.0
"""Beams count up to here, whatever their laser reaches."""
_SAMPLE_STEP: Final = 0.5
"""Distance of the samples along a beam, cells."""
_SAMPLES_AT_ONCE: Final = 1 << 22
"""Number of samples that are in memory at once."""

Floats = npt.NDArray[np.float64]


@dataclass
class _Frame:
    """The transforms of a frame in its parent: stamps (n,) in seconds, and x, y and turn (n, 3)."""

    parent: str
    stamps: list[float] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)
    is_static: bool = False

    def at(self, stamp: float) -> Pose | None:
        """Return the pose at a stamp (R2)."""
        if self.is_static or len(self.stamps) == 1:
            return self.poses[-1]
        if not self.stamps[0] <= stamp <= self.stamps[-1]:
            return None
        after = min(int(np.searchsorted(self.stamps, stamp)), len(self.stamps) - 1)
        before = max(after - 1, 0)
        span = self.stamps[after] - self.stamps[before]
        share = (stamp - self.stamps[before]) / span if span > 0 else 1.0
        (x1, y1, a1), (x2, y2, a2) = self.poses[before], self.poses[after]
        turn = wrap_angle(a2 - a1)
        return x1 + share * (x2 - x1), y1 + share * (y2 - y1), a1 + share * turn


@dataclass(frozen=True)
class _Scan:
    """A scan: its stamp (s), frame, directions and ranges (beams,), and the limits of its ranges (m)."""

    stamp: float
    frame: str
    angles: Floats
    ranges: Floats
    least_m: float
    most_m: float


def map_from_bag(
    path: str | os.PathLike[str], resolution_m: float = 0.05, *, scan_topic: str | None = None
) -> RobotMap:
    """Return the map of the scans of a bag.

    Parameters
    ----------
    path
        An .mcap or .db3 file, or the folder of a bag.
    resolution_m
        The side of a cell, metres.
    scan_topic
        The topic of the scans, if there are several.

    Returns
    -------
        Its frame is the one that no transform of the bag places (R2).

    Raises
    ------
    MapError
        The bag cannot be read, or has no scan with a pose.
    MissingDependencyError
        rosbags is not installed.

    Examples
    --------
    >>> map_of_bag("run.mcap").free.sum()  # doctest: +SKIP
    48211
    """
    file = Path(path)
    frames, scans = _contents(file, scan_topic)
    placed = [(scan, pose) for scan in scans if (pose := _pose_of(frames, scan)) is not None]
    if not placed:
        known = ", ".join(sorted(frames)) or "none"
        raise MapError(
            f"{file.name}: expected a transform of {scans[0].frame!r} at the time of a scan, found those of {known}",
            "record /tf and /tf_static with the scans",
            "empty",
        )
    return _draw_map(file.name, placed, resolution_m)


def _contents(file: Path, wanted: str | None) -> tuple[dict[str, _Frame], list[_Scan]]:
    frames: dict[str, _Frame] = {}
    scans: list[_Scan] = []
    with open_bag(file) as reader:
        chosen = _choose_topic(
            {each.topic for each in reader.connections if each.msgtype == SCAN_TYPE}, wanted, file.name
        )
        kept = [each for each in reader.connections if each.topic == chosen or each.msgtype == TF_TYPE]
        for connection, _, data in reader.messages(connections=kept):
            message: Any = reader.deserialize(data, connection.msgtype)
            if connection.msgtype == SCAN_TYPE:
                scans.append(_scan(message))
            else:
                _add(frames, message, is_static=connection.topic.endswith("tf_static"))
    if not scans:
        raise MapError(f"{file.name}: expected scans on {chosen}, found none", "record them", "empty")
    for frame in frames.values():
        order = np.argsort(frame.stamps, kind="stable").tolist()
        frame.stamps, frame.poses = [frame.stamps[k] for k in order], [frame.poses[k] for k in order]
    return frames, scans


def _choose_topic(topics: set[str], wanted: str | None, name: str) -> str:
    """Return the topic of the scans: the one that is wanted, or the only one of type ``sensor_msgs/LaserScan``."""
    if wanted is not None and wanted in topics:
        return wanted
    if wanted is None and len(topics) == 1:
        return next(iter(topics))
    found = ", ".join(sorted(topics)) or "none"
    expected = f"a topic {wanted!r} of type {SCAN_TYPE}" if wanted else f"one topic of type {SCAN_TYPE}"
    raise MapError(f"{name}: expected {expected}, found {found}", "name the topic of the scans", "empty")


def _scan(message: Any) -> _Scan:
    ranges = np.asarray(message.ranges, np.float64)
    angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
    most_m = min(float(message.range_max), FARTHEST_BEAM_M)
    frame = str(message.header.frame_id).lstrip("/")
    return _Scan(_seconds(message.header.stamp), frame, angles, ranges, float(message.range_min), most_m)


def _add(frames: dict[str, _Frame], message: Any, *, is_static: bool) -> None:
    for each in message.transforms:
        child, parent = str(each.child_frame_id).lstrip("/"), str(each.header.frame_id).lstrip("/")
        place, turn = each.transform.translation, each.transform.rotation
        yaw = yaw_from_quaternion(turn.x, turn.y, turn.z, turn.w)
        if not all(map(math.isfinite, (place.x, place.y, yaw))):
            continue
        frame = frames.setdefault(child, _Frame(parent, is_static=is_static))
        frame.parent = parent
        frame.stamps.append(_seconds(each.header.stamp))
        frame.poses.append((float(place.x), float(place.y), yaw))


def _seconds(stamp: Any) -> float:
    return float(stamp.sec) + float(stamp.nanosec) * 1e-9


def _pose_of(frames: dict[str, _Frame], scan: _Scan) -> Pose | None:
    """The pose of the laser, or None if a transform is missing at that time."""
    if scan.frame not in frames:
        return None
    pose, name, seen = (0.0, 0.0, 0.0), scan.frame, set[str]()
    while name in frames and name not in seen:
        seen.add(name)
        here = frames[name].at(scan.stamp)
        if here is None:
            return None
        pose, name = compose_poses(here, pose), frames[name].parent
    return pose


def _draw_map(name: str, placed: list[tuple[_Scan, Pose]], cell_m: float) -> RobotMap:
    """Return the map of some scans: cells in which beams end are hit, others along the beams are passed."""
    RobotMap(np.zeros((1, 1), np.int8), cell_m, name=name)  # checks the resolution
    far = [min(scan.most_m, float(np.max(_lengths(scan)[0], initial=0.0))) + 2 * cell_m for scan, _ in placed]
    x1 = min(x - reach for (_, (x, _, _)), reach in zip(placed, far, strict=True))
    y1 = min(y - reach for (_, (_, y, _)), reach in zip(placed, far, strict=True))
    x2 = max(x + reach for (_, (x, _, _)), reach in zip(placed, far, strict=True))
    y2 = max(y + reach for (_, (_, y, _)), reach in zip(placed, far, strict=True))
    west, south = math.floor(x1 / cell_m), math.floor(y1 / cell_m)
    rows, cols = math.ceil(y2 / cell_m) - south, math.ceil(x2 / cell_m) - west
    if rows * cols > MAX_MAP_CELLS:
        raise MapError(f"{name}: a map of {rows:,} x {cols:,} cells", "choose a larger resolution", "too_large")
    hits, seen = np.zeros(rows * cols, np.int32), np.zeros(rows * cols, np.int32)
    for scan, (x, y, turn) in placed:
        for cells, count in zip(
            _cells(scan, (x / cell_m - west, y / cell_m - south, turn), cell_m, cols), (hits, seen), strict=True
        ):
            count[cells] += 1
    occupancy = np.full(rows * cols, -1, np.int8)
    occupancy[seen > 0] = 0
    occupancy[(hits > 0) & (hits >= HIT * seen)] = 100
    grid = occupancy.reshape(rows, cols)
    known_rows, known_cols = np.flatnonzero((grid >= 0).any(axis=1)), np.flatnonzero((grid >= 0).any(axis=0))
    if not len(known_rows):
        raise MapError(f"{name}: no beam of any scan measured a distance", "check range_min and range_max", "empty")
    top, left = int(known_rows[-1]), int(known_cols[0])
    whole = np.ascontiguousarray(grid[known_rows[0] : top + 1, left : known_cols[-1] + 1][::-1])
    if max(whole.shape) < FEWEST_CELLS:
        rows, cols = whole.shape
        raise MapError(
            f"{name}: a map of {rows} x {cols} cells of {cell_m:g} m shows nothing",
            "choose a smaller resolution",
            "bad_units",
        )
    origin = ((west + left) * cell_m, (south + int(known_rows[0])) * cell_m, 0.0)
    return RobotMap(whole, cell_m, origin, name=name)


def _lengths(scan: _Scan) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """How far each beam passes (beams,), metres, NaN for nothing, and whether it hits."""
    hit = (scan.ranges >= scan.least_m) & (scan.ranges < scan.most_m)
    passed = scan.ranges >= scan.most_m  # also infinite
    return np.where(hit, scan.ranges, np.where(passed, scan.most_m, np.nan)), hit


def _cells(scan: _Scan, pose: Pose, cell_m: float, cols: int) -> Iterator[npt.NDArray[np.int64]]:
    """Yield the cells that a scan hits, and all that it sees, each once; ``pose`` is in cells, rows from the south."""
    lengths, hit = _lengths(scan)
    used = np.isfinite(lengths)
    lengths, hit, angles = lengths[used] / cell_m, hit[used], scan.angles[used] + pose[2]
    cos, sin = np.cos(angles), np.sin(angles)
    ends_x, ends_y = pose[0] + lengths * cos, pose[1] + lengths * sin
    ends = np.floor(ends_y).astype(np.int64) * cols + np.floor(ends_x).astype(np.int64)
    steps = np.arange(0.0, float(lengths.max(initial=0.0)), _SAMPLE_STEP)
    struck = np.unique(ends[hit])
    passed = [struck]
    at_once = max(_SAMPLES_AT_ONCE // max(len(steps), 1), 1)
    for first in range(0, len(lengths), at_once):
        some = slice(first, first + at_once)
        inside = steps[None] < lengths[some, None]
        x = np.floor(pose[0] + steps[None] * cos[some, None]).astype(np.int64)
        y = np.floor(pose[1] + steps[None] * sin[some, None]).astype(np.int64)
        passed.append(np.unique((y * cols + x)[inside]))
    yield struck
    yield np.unique(np.concatenate(passed))
