"""Houses that a fit has built are kept, and the next fit uses them, with the models of the day."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.fitting.rows import HouseRows, Part, PlanRow, rate_building
from pipeline.quality import doubt_plan
from pipeline.stages.logistic import LogisticModel, source_of
from research import built_houses, weights_fit
from research.built_houses import built_member
from research.confidence_fit import of_member
from tests.builders.shared import needs_shared

TASK = ("artist_named", 0)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the tests keep one house: the first of them builds it."""
    return tmp_path_factory.mktemp("kept")


@pytest.mark.slow
@needs_shared
def test_a_kept_house_is_not_built_again_and_gives_the_same_parts(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = of_member(TASK, 0, tmp_path, kept)
    assert {part.part for plan in first.plans for part in plan.parts} >= {"door", "entrance", "room"}
    assert {part.part for part in first.spaces} == {"space"}
    assert [plan.right for plan in first.plans] == [True]
    assert [file.name for file in kept.iterdir()] == ["made artist_named 0 0.pickle"]
    monkeypatch.setattr(built_houses, "make_member", None)
    assert of_member(TASK, 0, tmp_path, kept) == first
    house = built_member(TASK, 0, tmp_path, kept)
    assert len(house.outcome.plans) == len(house.truths) == 1
    assert house.outcome.rejected == []
    with pytest.raises(TypeError):
        built_member(TASK, 0, tmp_path, None)


@pytest.mark.slow
def test_grounds_that_rest_on_weights_are_measured_anew(kept: Path, tmp_path: Path) -> None:
    house = built_member(TASK, 0, tmp_path, kept)
    ((level, (building,)),) = house.storeys
    assert building.plan.quality is not None
    grounds = building.rated(level).grounds
    assert {name: round(value, 4) for name, value in grounds.items()} == pytest.approx(
        dict(building.plan.quality.grounds), abs=1e-4
    )


def test_the_doubt_of_spaces_comes_from_the_model_that_is_fitted() -> None:
    part = Part("room", "h", "corpus 1", true=True, features={"space:tiny": 1.0, "plan_doubtful_space": 0.9})
    plan = PlanRow("h", "corpus 1", True, {"doubtful_space": 0.9, "sealed": 1.0}, [{"tiny": 1.0}], [part], "a/b", "h")
    doubted = rate_building(plan, LogisticModel(0.0, {"tiny": -1.0}))
    assert doubted.grounds == {"doubtful_space": 0.46, "sealed": 1.0}
    assert doubted.parts[0].features == {
        "space:tiny": 1.0,
        "doubtful_space": 0.46,
        "plan_doubtful_space": 0.46,
        "plan_sealed": 1.0,
        "doubtful_plan": doubt_plan(doubted.grounds),
    }


@pytest.mark.slow
@needs_shared
def test_all_weights_come_from_one_fit_and_are_the_same_each_time(kept: Path, tmp_path: Path) -> None:
    made = [of_member(TASK, 0, tmp_path, kept), of_member(("solids", 2), 0, tmp_path, None)]
    rows = [row for row in made for _ in range(3)]
    first, again = (source_of(weights_fit.fit_all(rows), "") for _ in range(2))
    assert first == again
    assert [line for line in first.splitlines() if line.startswith("[") and "." not in line] == [
        "[space]",
        "[door]",
        "[entrance]",
        "[room]",
    ]
    assert isinstance(rows[0], HouseRows)
