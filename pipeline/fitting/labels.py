"""Read labels of storeys, and tell by them which rooms, spaces and ways of a plan are right.

``houseexpo labels`` writes them of reviewed houses (``houseexpo.dataset.storey_labels``); people who mark plans of the
corpus write the same lines.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from houseexpo.dataset.storey_labels import NEAR_WAY_M, Space, StoreyLabels
from houseexpo.errors import ConfigError
from pipeline.geometry.openings import Opening
from pipeline.source_record import extent_of
from pipeline.values import Input, Level

SAME_AREA: Final = 0.1
"""A room of a plan is the marked one if it holds its place, and their areas differ by no more than this share."""
SAME_EXTENT: Final = 0.02
"""A level is the marked one if its extent differs by no more than this share, or so many metres."""


class Marked(StoreyLabels, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """What a person has marked of one storey."""

    def is_of(self, level: Level) -> bool:
        """Whether a level is the storey that was marked, and as large."""
        same = self.level == level.frame.level
        return same and bool(np.allclose(extent_of(level), self.extent, rtol=SAME_EXTENT, atol=SAME_EXTENT))

    def judge_rooms(self, rooms: Sequence[Polygon]) -> list[bool | None]:
        """Return of each room, in the source's plan axes, whether it is one; None where nobody has marked it."""
        told = [(self.rooms, True), (self.unlike, False), (self.no_rooms, False)]
        return [_judge_space(room, told) for room in rooms]

    def judge_spaces(self, spaces: Sequence[Polygon], rooms: Sequence[Polygon] = ()) -> list[bool | None]:  # noqa: ARG002
        """Return of each space, in the source's plan axes, whether it is indoors; None where nobody has marked it."""
        told = [(self.rooms, True), (self.unlike, True), (self.no_rooms, False)]
        return [_judge_space(space, told) for space in spaces]

    def judge_ways(self, middles: npt.NDArray[np.float64], passages: Sequence[Opening] = ()) -> list[bool | None]:  # noqa: ARG002
        """Return of each passage (n, 2), by its middle, whether it is a way; None where nobody has marked it."""
        return [self._judge_way(middle) for middle in np.reshape(middles, (-1, 2))]

    def _judge_way(self, middle: npt.NDArray[np.float64]) -> bool | None:
        told = [(place, True) for place in self.ways] + [(place, False) for place in self.no_ways]
        if not told:
            return None
        apart = np.hypot(*(np.array([place for place, _ in told]) - middle).T)
        nearest = int(apart.argmin())
        return told[nearest][1] if apart[nearest] <= NEAR_WAY_M else None

    @property
    def item(self) -> Input:
        """The input that was reviewed, as its reader read it."""
        return Input(self.file, self.reader, self.path, self.key, tuple(sorted(self.options.items())))


def _judge_space(space: Polygon, told: Sequence[tuple[list[Space], bool]]) -> bool | None:
    for places, verdict in told:
        for x, y, area in places:
            if abs(space.area - area) <= SAME_AREA * area and shapely.contains_xy(space, x, y):
                return verdict
    return None


def read_labels(file: Path) -> Mapping[Input, list[Marked]]:
    """Return the labelled storeys of a file that ``houseexpo labels`` wrote, by their inputs, in the order of ids.

    Raises
    ------
    ConfigError
        The file cannot be read, a line holds no labels, or it does not say which file they are of.
    """
    try:
        lines = file.read_bytes().splitlines()
    except OSError as error:
        raise ConfigError(f"{file}: cannot be read ({error.strerror}); check the path") from None
    found: dict[Input, list[Marked]] = {}
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            marked = msgspec.json.decode(line, type=Marked)
        except msgspec.DecodeError as error:
            text = str(error)
            raise ConfigError(
                f"{file}, line {number}: expected labels of a storey, found something else ({text[0].lower()}"
                f"{text[1:]}); houseexpo labels writes such a file"
            ) from None
        if not all(map(math.isfinite, _numbers(marked))):
            raise ConfigError(f"{file}, line {number}: expected finite numbers, found one that is too large")
        if not (marked.path and marked.reader):
            raise ConfigError(
                f"{file}, line {number}: expected the file that they are of, found none; write them again: houseexpo "
                "labels"
            )
        found.setdefault(marked.item, []).append(marked)
    return {item: found[item] for item in sorted(found, key=lambda item: (item.id, item.path, item.key))}


def _numbers(value: Any) -> Iterator[float]:
    plain = msgspec.to_builtins(value) if isinstance(value, msgspec.Struct) else value
    if isinstance(plain, float | int):
        yield float(plain)
    elif isinstance(plain, dict | list | tuple):
        for part in plain.values() if isinstance(plain, dict) else plain:
            yield from _numbers(part)
