"""Homes in the formats of docs/sources.md: the same bytes for a seed, and plans that are right."""

import pytest

from tests.builders.kinds.measuring import measure
from tests.builders.kinds.registry import RAW, make_member
from tests.builders.shared import needs_shared

EXACT = [kind for kind in RAW if kind.startswith("raw_")]


@pytest.mark.parametrize("kind", EXACT)
def test_a_seed_gives_the_same_bytes_and_another_others(kind, tmp_path):
    first, again = (make_member(kind, 1, 5, tmp_path / name) for name in ("a", "b"))
    other = make_member(kind, 1, 6, tmp_path / "c")
    assert first.path.read_bytes() == again.path.read_bytes()
    assert first.truths == again.truths
    assert first.truths != other.truths


@needs_shared
@pytest.mark.parametrize("kind", EXACT)
def test_what_a_source_says_is_what_the_plan_holds(kind, tmp_path):
    outcome = measure(kind, 0, 1, str(tmp_path))
    assert outcome.met, outcome.failing
    assert all(score["width_error_m"] <= 0.05 for score in outcome.scores)
    assert kind == "raw_sdf" or all(score["label_accuracy"] >= 0.95 for score in outcome.scores)
