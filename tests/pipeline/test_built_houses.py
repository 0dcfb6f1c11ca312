"""Houses that a fit has built are kept, and the next fit uses them, with the models of the day."""

from __future__ import annotations

from pathlib import Path

import pytest

from research import built_houses
from research.built_houses import built_member
from research.confidence_fit import of_member

TASK = ("artist_named", 0)


def test_a_kept_house_is_not_built_again_and_gives_the_same_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept = tmp_path / "kept"
    first = of_member(TASK, 0, tmp_path, kept)
    assert {part.part for part in first} >= {"door", "entrance", "room"}
    assert [file.name for file in kept.iterdir()] == ["made artist_named 0 0.pickle"]
    monkeypatch.setattr(built_houses, "make_member", None)
    assert of_member(TASK, 0, tmp_path, kept) == first
    house = built_member(TASK, 0, tmp_path, kept)
    assert len(house.outcome.plans) == len(house.truths) == 1
    assert house.outcome.rejected == []
    with pytest.raises(TypeError):
        built_member(TASK, 0, tmp_path, None)


def test_grounds_that_rest_on_weights_are_measured_anew(tmp_path: Path) -> None:
    house = built_member(TASK, 0, tmp_path, None)
    ((level, (building,)),) = house.storeys
    assert building.plan.quality is not None
    grounds = building.rated(level).grounds
    assert {name: round(value, 4) for name, value in grounds.items()} == pytest.approx(
        dict(building.plan.quality.grounds), abs=1e-4
    )
