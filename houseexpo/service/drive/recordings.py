"""Encode a drive as a short text that replays it: the options of the robot, and each of its actions.

The simulator is deterministic: a plan, the options, the seed and the actions reproduce every frame. A recording has all
of these except the plan, which it names. It is part of a link, so that no server has to store it, and it works as
long as the plan is served.

A recording is MessagePack, compressed with zlib, in URL-safe base64 without padding. Actions are stored as runs: a key
that is held down gives a single run.
"""

from __future__ import annotations

import base64
import hashlib
import zlib
from collections.abc import Iterator
from typing import Annotated, Final, Literal, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.pseudoslam.simulator import ACTIONS
from houseexpo.service.drive.messages import MAX_STEPS, YOU, StartDrive

LONGEST_RECORDING: Final = 60_000
"""Characters of a recording: the size of a message of a socket."""
FULL_SPEED: Final = 127
"""The full speed in runs."""

_RUN: Final = np.dtype([("one", "i1"), ("two", "i1"), ("times", "<u2")])
_MOST_TIMES: Final = (1 << 16) - 1
_MOST_BYTES: Final = 1 << 20
_SAME_END: Final = 0.01

Action = tuple[int, int]
"""For a person, the speed forward and to the left, in 127ths of the full speed; for an explorer, the action and 0."""


class DriveEnd(NamedTuple):
    """The end of a drive: the position in plan metres, and the share of the house that was seen."""

    x_m: float
    y_m: float
    coverage: float

    def is_near(self, other: DriveEnd) -> bool:
        """Return whether another drive ended at the same place."""
        return all(abs(one - two) <= _SAME_END for one, two in zip(self, other, strict=True))


class Recording(msgspec.Struct, frozen=True, array_like=True):
    """A drive.

    Attributes
    ----------
    version
        The version of this format.
    start
        The options of the robot.
    shape
        A hash of the plan's geometry (``hash_geometry``): after a rebuild, the same id may name another shape.
    runs
        The actions and their numbers of repetitions, as ``_RUN``.
    end
        The end of the drive, with which a replay is compared.
    """

    version: Literal[1]
    start: StartDrive
    shape: Annotated[bytes, Meta(max_length=32)]
    runs: Annotated[bytes, Meta(max_length=4 * MAX_STEPS)]
    end: DriveEnd

    @property
    def steps(self) -> int:
        """The number of actions."""
        return int(np.frombuffer(self.runs, _RUN)["times"].sum())

    def actions(self) -> Iterator[Action]:
        """Yield the actions, one for each step."""
        for one, two, times in np.frombuffer(self.runs, _RUN).tolist():
            for _ in range(times):
                yield one, two

    def as_text(self) -> str:
        """Return the recording as text for a link, "" if it is too long for one."""
        packed = zlib.compress(msgspec.msgpack.encode(self), 9)
        text = base64.urlsafe_b64encode(packed).decode().rstrip("=")
        return text if len(text) <= LONGEST_RECORDING else ""


class Recorder:
    """Collects the actions of a drive."""

    def __init__(self, start: StartDrive, plan: FloorPlan) -> None:
        self._start, self._shape = start, hash_geometry(plan)
        self._runs: list[list[int]] = []

    def add(self, action: Action) -> None:
        """Add the action of a step."""
        if self._runs and (self._runs[-1][0], self._runs[-1][1]) == action and self._runs[-1][2] < _MOST_TIMES:
            self._runs[-1][2] += 1
        else:
            self._runs.append([*action, 1])

    def recording(self, end: DriveEnd) -> Recording:
        """Return the drive so far."""
        runs = np.array([tuple(run) for run in self._runs], _RUN)
        return Recording(1, self._start, self._shape, runs.tobytes(), end)


def hash_geometry(plan: FloorPlan) -> bytes:
    """Return a hash of the geometry that matters to a robot: the outline and the holes."""
    found = hashlib.sha256()
    for ring in (plan.verts, *plan.holes):
        found.update(np.ascontiguousarray(ring, "<f8").tobytes() + b"|")
    return found.digest()[:8]


def decode_recording(text: str) -> Recording:
    """Decode a recording from ``as_text``; raise ConfigError if it is not one."""
    try:
        packed = base64.b64decode(text + "=" * (-len(text) % 4), altchars=b"-_", validate=True)
        unpacking = zlib.decompressobj()
        data = unpacking.decompress(packed, _MOST_BYTES)
        if not unpacking.eof or unpacking.unused_data:
            raise ConfigError("recording: it is truncated or too long; copy the whole link")
        found = msgspec.msgpack.decode(data, type=Recording)
    except (ValueError, zlib.error, msgspec.DecodeError) as error:
        raise ConfigError(f"recording: it cannot be read ({error}); copy the whole link") from None
    _check_runs(found)
    return found


def _check_runs(found: Recording) -> None:
    if len(found.runs) % _RUN.itemsize:
        raise ConfigError("recording: its actions are truncated; copy the whole link")
    if found.steps > MAX_STEPS:
        raise ConfigError(f"recording: expected at most {MAX_STEPS} steps, found {found.steps}")
    runs = np.frombuffer(found.runs, _RUN)
    if found.start.driver != YOU:
        known = (runs["one"] >= 0) & (runs["one"] < len(ACTIONS)) & (runs["two"] == 0)
    else:
        known = (runs["one"] >= -FULL_SPEED) & (runs["two"] >= -FULL_SPEED)
    if not known.all():
        raise ConfigError("recording: it contains unknown actions; copy the whole link")
