"""Marks that people put on the parts of plans."""

from __future__ import annotations

import msgspec
import numpy as np
import shapely

from tests.builders.houses import Hole, level, two_rooms
from tests.corpus import marks
from tests.corpus.manifest import Verdict
from tests.corpus.manifest import load as load_manifest
from tests.corpus.marks import Marked
from tests.corpus.truths import extent_of

MARKED = Marked(
    "house",
    0,
    (7.6, 3.4),
    rooms=[(2.0, 1.5, 12.0)],
    unlike=[(5.7, 1.5, 9.0)],
    no_rooms=[(2.0, -1.0, 6.4)],
    ways=[(4.1, 1.45)],
    no_ways=[(4.1, 2.4)],
)


def test_a_room_is_judged_by_the_mark_in_it_if_it_is_as_large() -> None:
    spaces = [shapely.box(*b) for b in ((0, 0, 4, 3), (4.2, 0, 7.2, 3), (0, -1.8, 4, -0.2), (0, 0, 7.2, 3))]
    assert MARKED.judge_rooms(spaces) == [True, False, False, None]
    assert MARKED.judge_spaces(spaces) == [True, True, False, None]


def test_a_passage_is_judged_by_the_nearest_mark() -> None:
    assert MARKED.judge_ways(np.array([[4.1, 1.5], [4.1, 2.3], [0.0, 0.0]])) == [True, False, None]


def test_marks_are_of_a_level_as_large_as_it_was() -> None:
    house = level(two_rooms(Hole(1.0, 1.9)))
    of_it = msgspec.structs.replace(MARKED, extent=extent_of(house))
    assert of_it.is_of(house)
    assert not of_it.is_of(level(two_rooms(Hole(1.0, 1.9))[:1]))


def test_the_marked_files_are_in_the_list() -> None:
    verdicts = {file.name: file.verdict for file in load_manifest()}
    assert len(marks.load()) > 100
    assert all(verdicts[name] in {Verdict.RIGHT, Verdict.PARTLY, Verdict.WRONG} for name in marks.load())
    assert all(each.rooms or each.unlike or each.no_rooms or each.ways for its in marks.load().values() for each in its)
