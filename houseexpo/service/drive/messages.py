"""Decode the messages (JSON) of a driver's browser, with the simulator configuration they ask for; encode its frames.

A frame has the changed cells of the map, pose and scores, the laser's beams and the bodies in sight. It is little
endian: ``HEAD``; six float32 for each body in sight (its number, x, y, radius, and velocity across and down, cells a
second); a uint16 for each beam (its length in 1/32 of a cell); then the cells of the changed rectangle, row by row, as
runs: a uint16 each, the two highest bits are the state (0 unknown, 1 free, 2 obstacle), the others the number of cells.
"""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import Annotated, Final, Literal, NamedTuple, TypeAlias

import msgspec
import numpy as np
import numpy.typing as npt
from msgspec import Meta

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.config.obstacles import ObstaclesConfig, RandomObstacles
from houseexpo.pseudoslam.config.robot import LaserConfig, NoiseConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.render.sight import Sight

YOU: Final = "you"
FRAMES_PER_S: Final = 30
MOST_STEPS_PER_S: Final = 120
"""Steps per second of an explorer: four per frame."""
LONGEST_MESSAGE: Final = 2_000
"""Characters of a message."""
MAX_STEPS: Final = 50_000
"""Steps of an episode in the browser: half an hour without a pause."""

_SPEEDS: Final = {"slow": (0.75, 45.0), "normal": (1.5, 90.0), "fast": (3.0, 150.0)}
"""Metres and degrees per second."""
_NOISE: Final = {
    "none": NoiseConfig(),
    "some": NoiseConfig(laser_m=0.02, odometry_way=0.02, odometry_turn=0.02, odometry_deg_per_m=0.5),
    "much": NoiseConfig(
        laser_m=0.05, odometry_way=0.08, odometry_turn=0.06, odometry_deg_per_m=2.0, drop_out=0.05, max_range=0.02
    ),
}

Share = Annotated[float, Meta(ge=-1, le=1)]


class StartDrive(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, tag="start", tag_field="do"
):
    """Place a robot; ``driver`` is "you", or the name of an explorer or of one of the server's policies."""

    plan: Annotated[str, Meta(min_length=1, max_length=300)]
    driver: Annotated[str, Meta(max_length=300)] = YOU
    range_m: Annotated[float, Meta(ge=1, le=20)] = 5.0
    fov_deg: Annotated[float, Meta(ge=30, le=360)] = 180.0
    noise: Literal["none", "some", "much"] = "none"
    people: Annotated[int, Meta(ge=0, le=20)] = 0
    obstacles: Annotated[int, Meta(ge=0, le=20)] = 0
    speed: Literal["slow", "normal", "fast"] = "normal"
    seed: Annotated[int, Meta(ge=0, lt=2**32)] = 0

    @property
    def config(self) -> SimulatorConfig:
        """The simulation: for a person, a step takes one frame; for an explorer, steps are those of the benchmark."""
        common = SimulatorConfig(
            laser=LaserConfig(range_m=self.range_m, fov_deg=self.fov_deg),
            noise=_NOISE[self.noise],
            people=PeopleConfig(self.people),
            obstacles=ObstaclesConfig(
                random=RandomObstacles((self.obstacles, self.obstacles)) if self.obstacles else None
            ),
            max_steps=MAX_STEPS,
        )
        if self.driver != YOU:
            return common
        way, turn = _SPEEDS[self.speed]
        robot = replace(common.robot, step_m=way / FRAMES_PER_S, turn_deg=turn / FRAMES_PER_S)
        return replace(common, robot=robot, step_s=1 / FRAMES_PER_S)


class MoveRobot(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="move", tag_field="do"):
    """Move until the next message, at shares of the full speed, forward and to the left."""

    linear: Share
    angular: Share


class SetPace(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="pace", tag_field="do"):
    """Set the steps per second of an explorer; 0 is a pause."""

    steps_per_s: Annotated[float, Meta(ge=0, le=MOST_STEPS_PER_S)]


class FrameDrawn(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="seen", tag_field="do"):
    """The browser has drawn this frame."""

    number: Annotated[int, Meta(ge=0, lt=2**32)]


class SendPathAndMap(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="save", tag_field="do"):
    """Send the path and the map."""


class FinishDrive(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag="finish", tag_field="do"):
    """End the drive and send its results."""


Message: TypeAlias = StartDrive | MoveRobot | SetPace | FrameDrawn | SendPathAndMap | FinishDrive


def decode_message(text: str) -> Message:
    """Decode a message; raise ConfigError if it is not one."""
    if len(text) > LONGEST_MESSAGE:
        raise ConfigError(f"message: expected at most {LONGEST_MESSAGE} characters, found {len(text)}")
    try:
        found: Message = msgspec.json.decode(text, type=Message)
    except msgspec.DecodeError as error:
        raise ConfigError(f"message: {error}") from None
    return found


Grid = npt.NDArray[np.uint8]

HEAD: Final = struct.Struct("<BBHIIffffffHHHHHH")
"""Kind (1), flags, bumps, number, steps so far, pose (x across, y down, heading), explored m2, coverage, path m, the
rectangle's first row and column, rows and columns, bodies, beams."""
KIND: Final = 1
SAVED: Final = 2
"""The first byte of a saved run; a zip archive follows."""
COLLIDED: Final = 1
ENDED: Final = 2
SUCCESS: Final = 4
LONGEST_RUN: Final = (1 << 14) - 1
STEPS_PER_CELL: Final = 32

_CODES: Final = np.zeros(256, np.uint16)
_CODES[[FREE, OBSTACLE]] = 1 << 14, 2 << 14


class RobotReport(NamedTuple):
    """The state of the robot; ``pose_px`` is the pose by odometry, ``bumps`` are counted by ``robots.BumpCounter``."""

    number: int
    flags: int
    bumps: int
    steps: int
    pose_px: tuple[float, float, float]
    explored_m2: float
    coverage: float
    path_m: float


class MapDelta(NamedTuple):
    """The rectangle of the map that contains all changes, as runs."""

    row: int
    col: int
    rows: int
    cols: int
    runs: npt.NDArray[np.uint16]


class SentMap:
    """The map that the browser has; at first all of it is unknown."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._sent = np.zeros(shape, np.uint8)

    def update(self, known: Grid) -> MapDelta:
        """Return the changes since the last call: a rectangle of cells, empty without changes."""
        changed = known != self._sent
        rows = np.flatnonzero(changed.any(axis=1))
        if not len(rows):
            return MapDelta(0, 0, 0, 0, np.empty(0, np.uint16))
        top, bottom = int(rows[0]), int(rows[-1]) + 1
        cols = np.flatnonzero(changed[top:bottom].any(axis=0))
        left, right = int(cols[0]), int(cols[-1]) + 1
        part = known[top:bottom, left:right]
        self._sent[top:bottom, left:right] = part
        return MapDelta(top, left, bottom - top, right - left, encode_runs(part))


def encode_runs(cells: Grid) -> npt.NDArray[np.uint16]:
    """Return cells of a map (rows, cols) as runs, row by row."""
    codes = _CODES[cells.ravel()]
    starts = np.concatenate([[0], np.flatnonzero(codes[1:] != codes[:-1]) + 1])
    lengths = np.diff(starts, append=len(codes))
    pieces = -(-lengths // LONGEST_RUN)
    values = codes[starts].repeat(pieces)
    full = np.full(len(values), LONGEST_RUN)
    ends = np.cumsum(pieces) - 1
    full[ends] = lengths - (pieces - 1) * LONGEST_RUN
    runs: npt.NDArray[np.uint16] = values | full.astype(np.uint16)
    return runs


def encode_frame(report: RobotReport, delta: MapDelta, sight: Sight) -> bytes:
    """Return a frame."""
    head = HEAD.pack(
        KIND, report.flags, min(report.bumps, 65535), report.number, report.steps, *report.pose_px, report.explored_m2,
        report.coverage, report.path_m, *delta[:4], len(sight.bodies), len(sight.ranges),
    )  # fmt: skip
    beams = np.minimum(sight.ranges * STEPS_PER_CELL, 65535).astype("<u2")
    return b"".join([head, sight.bodies.astype("<f4").tobytes(), beams.tobytes(), delta.runs.astype("<u2").tobytes()])
