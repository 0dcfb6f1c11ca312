"""Stage dedupe: groups only; the comparison has its own tests."""

import numpy as np
import pytest

from pipeline.config import DedupeConfig
from pipeline.stages.dedupe import dedupe


def mask(rows: int, cols: int, *bays: tuple[int, int]) -> np.ndarray:
    """A room with bays knocked off its corner, so that it is chiral."""
    found = np.ones((rows, cols), bool)
    found[:4, :9] = False
    for row, col in bays:
        found[row, col] = False
    return found


ROOM = mask(40, 60)
MASKS = {"b": ROOM, "a": np.rot90(ROOM), "c": mask(40, 60, (20, 20)), "d": mask(60, 60), "e": ROOM[::-1]}


def test_the_first_of_each_group_is_kept_whatever_the_order_and_symmetry() -> None:
    found = dedupe(MASKS, DedupeConfig())
    assert [d.id for d in found] == ["b", "c", "e"]
    assert {d.kept_id for d in found} == {"a"}
    assert found == dedupe(dict(reversed(MASKS.items())), DedupeConfig())


def test_a_threshold_of_nothing_asks_for_equal_plans() -> None:
    assert [d.id for d in dedupe(MASKS, DedupeConfig(threshold=0.0))] == ["b", "e"]


def test_a_person_keeps_what_they_want() -> None:
    assert [d.id for d in dedupe(MASKS, DedupeConfig(), keep={"c"})] == ["b", "e"]


@pytest.mark.parametrize("masks", [{}, {"a": ROOM}])
def test_nothing_to_compare(masks: dict) -> None:
    assert dedupe(masks, DedupeConfig()) == []
