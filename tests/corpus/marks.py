"""Marks that people have put on the parts of plans: which spaces are rooms, which passages are ways.

Drawing the truth of a storey (``tests.corpus.truths``) takes long. To mark what a plan has of it takes a minute: a
person looks at the source, cut open and in sections, and says of each space whether it is a room of the house, and of
each passage whether one can walk through it. ``marks.jsonl`` holds a line for each storey of files that are not right::

    {"file": "NAME", "level": 0, "extent": [8.2, 6.1], "rooms": [[x, y, m2]], "unlike": [[x, y, m2]],
     "no_rooms": [[x, y, m2]], "ways": [[x, y]], "no_ways": [[x, y]]}

``houseexpo labels`` writes the same lines of reviewed houses, with the ``path`` of each file
(``houseexpo.service.review.labels``).

Lengths are metres in the source's plan axes. ``unlike`` are indoors, but not one room each: several rooms in one, or a
part of a room. ``no_rooms`` are terraces, courts, voids, the insides of walls, and what else was taken for rooms, or
might be. What a person could not tell is not in the file. What nobody has seen, because no plan had it, is not either.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Final

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from houseexpo.dataset.storey_labels import Space, StoreyLabels
from pipeline.values import Level
from tests.corpus import truths

MARKS: Final = Path(__file__).with_name("marks.jsonl")
SAME_AREA: Final = 0.1
"""A room of a plan is the marked one if it holds its place, and their areas differ by no more than this share."""


class Marked(StoreyLabels, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """What a person has marked of one storey."""

    def is_of(self, level: Level) -> bool:
        """Whether a level is the storey that was marked, and as large."""
        same = self.level == level.frame.level
        return same and bool(np.allclose(truths.extent_of(level), self.extent, rtol=truths.SAME, atol=truths.SAME))

    def judge_rooms(self, rooms: Sequence[Polygon]) -> list[bool | None]:
        """Return of each room, in the source's plan axes, whether it is one; None where nobody has marked it."""
        told = [(self.rooms, True), (self.unlike, False), (self.no_rooms, False)]
        return [_judge_space(room, told) for room in rooms]

    def judge_spaces(self, spaces: Sequence[Polygon]) -> list[bool | None]:
        """Return of each space, in the source's plan axes, whether it is indoors; None where nobody has marked it."""
        told = [(self.rooms, True), (self.unlike, True), (self.no_rooms, False)]
        return [_judge_space(space, told) for space in spaces]

    def judge_ways(self, middles: npt.NDArray[np.float64]) -> list[bool | None]:
        """Return of each passage (n, 2), by its middle, whether it is a way; None where nobody has marked it."""
        return [self._judge_way(middle) for middle in np.reshape(middles, (-1, 2))]

    def _judge_way(self, middle: npt.NDArray[np.float64]) -> bool | None:
        told = [(place, True) for place in self.ways] + [(place, False) for place in self.no_ways]
        if not told:
            return None
        apart = np.hypot(*(np.array([place for place, _ in told]) - middle).T)
        nearest = int(apart.argmin())
        return told[nearest][1] if apart[nearest] <= truths.NEAR_M else None


def _judge_space(space: Polygon, told: Sequence[tuple[list[Space], bool]]) -> bool | None:
    for places, verdict in told:
        for x, y, area in places:
            if abs(space.area - area) <= SAME_AREA * area and shapely.contains_xy(space, x, y):
                return verdict
    return None


@cache
def load(path: Path = MARKS) -> dict[str, list[Marked]]:
    """Return the marked storeys by the names of their files."""
    found: dict[str, list[Marked]] = {}
    for line in path.read_bytes().splitlines():
        marked = msgspec.json.decode(line, type=Marked)
        found.setdefault(marked.file, []).append(marked)
    return found
