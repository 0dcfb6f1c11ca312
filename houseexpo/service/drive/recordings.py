"""A drive as a few hundred letters that replay it: what the robot was set down with, and each of its actions.

The simulator is deterministic: a plan, the options, the seed and the actions give every frame again. A recording holds
all of these but the plan, which it names. It travels in a link, so that no server has to keep it, and it works as long
as the plan is served.

A recording is MessagePack, compressed with zlib, in URL-safe base64 without padding. Actions are stored as runs: what a
key that is held down does is one run, however long.
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
from houseexpo.service.drive.messages import MAX_STEPS, YOU, Start

LONGEST: Final = 60_000
"""Characters of a recording: what one message of a socket holds."""
FULL: Final = 127
"""The full speed, as runs store it."""

_RUN: Final = np.dtype([("one", "i1"), ("two", "i1"), ("times", "<u2")])
_MOST_TIMES: Final = (1 << 16) - 1
_MOST_BYTES: Final = 1 << 20
_SAME_M: Final = 0.01

Action = tuple[int, int]
"""Of a person: speed ahead and to the left, in 127ths of the full speed. Of an explorer: the action's number and 0."""


class End(NamedTuple):
    """Where a drive ended: metres of the plan, and the share of the house that was seen."""

    x_m: float
    y_m: float
    coverage: float

    def is_near(self, other: End) -> bool:
        """Whether a replay that ended there ended at the same place."""
        return all(abs(one - two) <= _SAME_M for one, two in zip(self, other, strict=True))


class Recording(msgspec.Struct, frozen=True, array_like=True):
    """A drive.

    Attributes
    ----------
    version
        Of this form.
    start
        What the robot was set down with.
    shape
        A hash of the plan's geometry (``shape_of``): after a new build the same id may name another shape.
    runs
        Actions and how often each was repeated, as ``_RUN``.
    end
        Where the drive ended; a replay is compared with it.
    """

    version: Literal[1]
    start: Start
    shape: Annotated[bytes, Meta(max_length=32)]
    runs: Annotated[bytes, Meta(max_length=4 * MAX_STEPS)]
    end: End

    @property
    def steps(self) -> int:
        """How many actions there are."""
        return int(np.frombuffer(self.runs, _RUN)["times"].sum())

    def actions(self) -> Iterator[Action]:
        """Yield the actions, one for each step."""
        for one, two, times in np.frombuffer(self.runs, _RUN).tolist():
            for _ in range(times):
                yield one, two

    def as_text(self) -> str:
        """Return the recording as it stands in a link, or "" if it is too long for one."""
        packed = zlib.compress(msgspec.msgpack.encode(self), 9)
        text = base64.urlsafe_b64encode(packed).decode().rstrip("=")
        return text if len(text) <= LONGEST else ""


class Recorder:
    """Collects the actions of a drive."""

    def __init__(self, start: Start, plan: FloorPlan) -> None:
        self._start, self._shape = start, shape_of(plan)
        self._runs: list[list[int]] = []

    def add(self, action: Action) -> None:
        """Note the action of a step."""
        if self._runs and (self._runs[-1][0], self._runs[-1][1]) == action and self._runs[-1][2] < _MOST_TIMES:
            self._runs[-1][2] += 1
        else:
            self._runs.append([*action, 1])

    def recording(self, end: End) -> Recording:
        """Return the drive so far."""
        runs = np.array([tuple(run) for run in self._runs], _RUN)
        return Recording(1, self._start, self._shape, runs.tobytes(), end)


def shape_of(plan: FloorPlan) -> bytes:
    """Return a hash of what a plan is to a robot: its outline and its holes."""
    found = hashlib.sha256()
    for ring in (plan.verts, *plan.holes):
        found.update(np.ascontiguousarray(ring, "<f8").tobytes() + b"|")
    return found.digest()[:8]


def read_recording(text: str) -> Recording:
    """Read a recording that ``as_text`` wrote; raise ConfigError if it is none."""
    try:
        packed = base64.b64decode(text + "=" * (-len(text) % 4), altchars=b"-_", validate=True)
        unpacking = zlib.decompressobj()
        data = unpacking.decompress(packed, _MOST_BYTES)
        if not unpacking.eof or unpacking.unused_data:
            raise ConfigError("recording: it is cut off, or too long; copy the whole link")
        found = msgspec.msgpack.decode(data, type=Recording)
    except (ValueError, zlib.error, msgspec.DecodeError) as error:
        raise ConfigError(f"recording: it cannot be read ({error}); copy the whole link") from None
    _check_runs(found)
    return found


def _check_runs(found: Recording) -> None:
    if len(found.runs) % _RUN.itemsize:
        raise ConfigError("recording: its actions are cut off; copy the whole link")
    if found.steps > MAX_STEPS:
        raise ConfigError(f"recording: expected at most {MAX_STEPS} steps, found {found.steps}")
    runs = np.frombuffer(found.runs, _RUN)
    if found.start.driver != YOU:
        known = (runs["one"] >= 0) & (runs["one"] < len(ACTIONS)) & (runs["two"] == 0)
    else:
        known = (runs["one"] >= -FULL) & (runs["two"] >= -FULL)
    if not known.all():
        raise ConfigError("recording: it has actions that there are not; copy the whole link")
