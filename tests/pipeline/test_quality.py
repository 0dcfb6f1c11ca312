from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from PIL import Image

from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Quality
from pipeline.overrides import Override
from pipeline.quality import GROUNDS, check_quality, main_grounds, score_quality
from pipeline.rejection import Reason, Rejection
from tests.builders.batch import lines, one_room, run_build
from tests.builders.doubts import doubting

SQUARE = [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)]


def plan(quality: Quality | None) -> FloorPlan:
    return FloorPlan("square", SQUARE, 1, {}, quality=quality)


def test_a_plan_against_which_nothing_speaks_is_sure() -> None:
    assert not score_quality({}).is_doubtful
    assert score_quality({ground.name: 0.0 for ground in GROUNDS}).score == score_quality({}).score


@pytest.mark.parametrize("ground", GROUNDS, ids=lambda ground: ground.name)
def test_each_ground_speaks_against_a_plan_the_more_of_it_there_is(ground) -> None:
    assert ground.weight <= 0
    scores = [score_quality({ground.name: value}).score for value in (0.0, 0.5, 1.0)]
    assert scores == sorted(scores, reverse=True)


def test_a_plan_against_which_everything_speaks_is_doubtful() -> None:
    assert score_quality({ground.name: 1.0 for ground in GROUNDS}).is_doubtful


def test_grounds_are_kept_to_four_digits_and_unknown_ones_weigh_nothing() -> None:
    quality = score_quality({"cut_share": 1 / 3, "phase_of_the_moon": 1.0})
    assert quality.grounds == {"cut_share": 0.3333, "phase_of_the_moon": 1.0}
    assert quality.score == score_quality({"cut_share": 1 / 3}).score


def test_the_main_grounds_are_the_weightiest_and_said_in_words() -> None:
    heaviest = min(GROUNDS, key=lambda ground: ground.weight)
    said = main_grounds(score_quality({ground.name: 1.0 for ground in GROUNDS}), most=2)
    assert len(said) == 2
    assert said[0] == f"{heaviest.about}: 1.00"
    assert main_grounds(score_quality({})) == []
    assert main_grounds(score_quality({heaviest.name: 0.001})) == []


def test_a_plan_less_sure_than_asked_for_is_refused_with_its_grounds() -> None:
    with pytest.raises(Rejection, match=r"expected a quality of 0.8 or more, found 0.75 .*cuts.*: 0.50") as caught:
        check_quality(plan(Quality(0.75, {"cut_share": 0.5})), 0.8)
    assert (caught.value.stage, caught.value.reason) == ("quality", Reason.DOUBTFUL)
    assert np.asarray(Image.open(io.BytesIO(caught.value.picture))).std() > 0
    check_quality(plan(Quality(0.8)), 0.8)
    check_quality(plan(None), 0.8)


def test_a_build_counts_the_doubtful_and_rejects_them_where_it_is_asked_to(tmp_path: Path) -> None:
    street = tmp_path / "street"
    for i, name in enumerate(("sure_30", "sure_79", "sure_80", "silent")):
        one_room(street / f"{name}.ply", 4.0 + i)
    data_set = run_build([street], tmp_path / "all", plan=doubting)
    assert (data_set.stats["outcomes"]["plans"], data_set.stats["outcomes"]["doubtful"]) == (4, 2)
    rows = pq.read_table(tmp_path / "all" / "index.parquet").to_pylist()
    assert {row["id"]: row["quality"] for row in rows} == {
        "sure_30": 0.3,
        "sure_79": 0.79,
        "sure_80": 0.8,
        "silent": None,
    }
    words = {"sure_30": Override(keep=True)}
    data_set = run_build([street], tmp_path / "sure", plan=doubting, min_quality=0.8, overrides=words)
    assert data_set.ids == ("silent", "sure_30", "sure_80")
    (refused,) = lines(tmp_path / "sure" / "rejected.jsonl")
    assert (refused["id"], refused["stage"], refused["reason"]) == ("sure_79", "quality", "doubtful")
    assert set(refused) == {"id", "stage", "reason", "detail", "advice"}
