"""The quality of plans, and the fit of its model."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import shapely
import trimesh
from PIL import Image

from houseexpo.corrections import Override
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Quality, explanations
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.quality import (
    BIAS,
    GROUNDS,
    SPREAD,
    WHOLE,
    check_quality,
    counted,
    doubt_plan,
    main_grounds_in_words,
    score_quality,
)
from pipeline.rejection import Reason, Rejection
from tests.builders.batch import doubting, lines, one_room, run_build
from tests.builders.houses import level, plan_of, wall
from tests.builders.judged import (
    MOST,
    NAMES,
    Judged,
    area_under_curve,
    fit,
    left_out_scores,
    likeliest_model,
    logit,
    per_file,
    precision_at,
    split,
    threshold,
)
from tests.builders.meshes import box

SQUARE = [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)]


def plan(quality: Quality | None) -> FloorPlan:
    return FloorPlan("square", SQUARE, 1, {}, quality=quality)


def test_a_plan_against_which_nothing_speaks_is_sure() -> None:
    assert not score_quality({}).is_doubtful
    assert score_quality({ground.name: 0.0 for ground in GROUNDS}).score == score_quality({}).score


@pytest.mark.parametrize("ground", GROUNDS, ids=lambda ground: ground.name)
def test_each_ground_speaks_against_a_plan_the_more_of_it_there_is(ground) -> None:
    assert ground.weight <= 0
    scores = [score_quality({ground.name: value}).score for value in (0.0, WHOLE / 2, WHOLE)]
    assert scores == sorted(scores, reverse=True)


def test_one_fault_among_many_parts_counts_as_much_as_many() -> None:
    assert [counted(value) for value in (0.0, WHOLE / 2, WHOLE, 1.0)] == [0.0, 0.5, 1.0, 1.0]
    assert score_quality({"roomless_wall_share": 0.1}).score == score_quality({"roomless_wall_share": 1.0}).score < 0.8
    few, many = (score_quality({"loose_end_share": value}, marked=True).score for value in (0.1, 1.0))
    assert many < few


def test_a_score_is_spread_about_that_of_a_sure_plan() -> None:
    weights = {ground.name: ground.weight for ground in GROUNDS}
    log_odds = BIAS + weights["tall"] + weights["sealed"]
    score = score_quality({"tall": 1.0, "sealed": 1.0}).score
    assert logit(score) - logit(0.8) == pytest.approx((log_odds - logit(0.8)) / SPREAD, abs=1e-3)
    assert SPREAD > 1


def test_what_the_parts_of_a_plan_are_doubted_by_is_not_spread() -> None:
    assert doubt_plan({}) == 0.0
    weight = next(ground.weight for ground in GROUNDS if ground.name == "tall")
    share = (1 + math.exp(-BIAS)) / (1 + math.exp(-BIAS - weight))
    assert doubt_plan({"tall": 1.0}) == pytest.approx(1 - share)
    assert doubt_plan({"tall": 1.0}, marked=True) == 0.0


def test_grounds_are_kept_to_four_digits_and_unknown_ones_weigh_nothing() -> None:
    quality = score_quality({"cut_share": 1 / 3, "phase_of_the_moon": 1.0})
    assert quality.grounds == {"cut_share": 0.3333, "phase_of_the_moon": 1.0}
    assert quality.score == score_quality({"cut_share": 1 / 3}).score


def test_the_main_grounds_are_the_weightiest_and_said_in_words() -> None:
    heaviest = min(GROUNDS, key=lambda ground: ground.weight)
    said = main_grounds_in_words(score_quality({ground.name: 1.0 for ground in GROUNDS}))
    assert len(said) == 3
    assert said[0] == f"{explanations.GROUNDS[heaviest.name]}: 1.00"
    assert main_grounds_in_words(score_quality({})) == []
    assert main_grounds_in_words(score_quality({heaviest.name: 0.001})) == []


def test_the_main_grounds_of_a_marked_house_have_the_weights_of_its_model() -> None:
    grounds = {"twin_door_share": 0.9, "roomless_floor_share": 0.8, "guesses": 0.3, "tall": 1.0}
    said = main_grounds_in_words(score_quality(grounds, marked=True))
    assert [words.rsplit(": ", 1)[1] for words in said] == ["0.90", "0.80", "0.30"]
    assert any(words.endswith(": 1.00") for words in main_grounds_in_words(score_quality(grounds)))


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


# The arithmetic by which the model of quality is fitted and judged, on numbers that can be checked by hand.


def made(n: int, seed: int) -> list[Judged]:
    """Plans that are right unless many doors are cuts; the other grounds say nothing."""
    rng = np.random.default_rng(seed)
    plans = []
    for k in range(n):
        grounds = {name: WHOLE * float(rng.random()) * (MOST[name] == 0) for name in NAMES}
        met = bool(rng.random() < 1 / (1 + math.exp(-(4 - 9 * counted(grounds["cut_share"])))))
        plans.append(Judged(f"house {k // 2}", "made", met, 0.5, grounds))
    return plans


def test_the_area_under_the_curve_is_the_share_of_pairs_in_order() -> None:
    scores, met = np.array([0.9, 0.8, 0.7, 0.7]), np.array([True, False, True, False])
    assert area_under_curve(scores, met) == (1 + 1 + 0 + 0.5) / 4
    assert math.isnan(area_under_curve(scores, np.ones(4, bool)))


def test_precision_counts_the_plans_at_or_above_the_score() -> None:
    scores, met = np.array([0.9, 0.8, 0.8, 0.7]), np.array([True, True, False, False])
    assert precision_at(scores, met) == pytest.approx(2 / 3)
    assert math.isnan(precision_at(scores, met, 0.95))


def test_the_threshold_is_the_lowest_from_which_on_all_is_well() -> None:
    scores, met = np.array([0.9, 0.8, 0.7, 0.6, 0.5]), np.array([True, True, False, True, True])
    assert threshold(scores, met, 0.95) == 0.8
    assert threshold(scores, met, 0.6) == 0.5
    assert threshold(scores, ~met, 0.95) == 0.9


def test_a_fit_finds_the_ground_that_matters_and_no_weight_is_above_nothing() -> None:
    model = fit(made(800, 1))
    assert min(model.weights, key=lambda name: model.weights[name]) == "cut_share"
    assert all(model.weights[ground.name] <= ground.most <= 0 for ground in GROUNDS)
    assert fit(made(800, 1)) == model


def test_a_box_in_which_nothing_shows_a_use_is_doubtful_and_a_furnished_one_is_not() -> None:
    assert score_quality({"sealed": 1.0, "bare": 1.0}).score < 0.79
    assert not score_quality({"sealed": 1.0, "bare": 0.0}).is_doubtful


def test_a_fit_holds_on_plans_that_it_has_not_seen() -> None:
    model, others = fit(made(3000, 1), 0.95), made(800, 2)
    met = np.array([plan.met for plan in others])
    assert precision_at(model.scores(others), met) >= 0.92
    assert area_under_curve(model.scores(others), met) >= 0.85
    assert (model.scores(others) >= 0.8).mean() > 0.15


def real(n: int, seed: int, *, storeys: int = 1) -> list[Judged]:
    """Plans of files, of which so many storeys are right that one is wrong where the file is."""
    plans = []
    for k, plan in enumerate(made(n, seed)):
        cuts = [plan.grounds["cut_share"], *[0.0] * (storeys - 1)]
        plans += [Judged(f"owner/{k}", "corpus 1", plan.met, 0.5, {"cut_share": cut}, f"file {k}") for cut in cuts]
    return plans


def test_a_file_counts_once_however_many_plans_it_has() -> None:
    alone, often = (likeliest_model(real(100, 4) + of_one_file(n)) for n in (1, 50))
    assert alone.weights["cut_share"] < 0
    assert often.weights["cut_share"] == pytest.approx(alone.weights["cut_share"], abs=1e-3)
    plans = real(100, 4, storeys=4)
    scores, met = per_file(plans, fit(plans).scores(plans))
    assert len(scores) == len(met) == 100
    assert area_under_curve(scores, met) >= 0.85


def of_one_file(n: int) -> list[Judged]:
    return [Judged("owner/more", "corpus 1", True, 0.5, {"cut_share": 0.08}, "one more") for _ in range(n)]


def test_a_lowered_model_keeps_the_order_and_the_weights_that_a_fit_may_not_weaken() -> None:
    model = likeliest_model(real(100, 4))
    lower, plans = model.lowered(logit(0.8)), real(50, 5)
    assert list(np.argsort(lower.scores(plans))) == list(np.argsort(model.scores(plans)))
    assert lower.spread == pytest.approx(2.0)
    assert logit(lower.scores(plans)[0]) == pytest.approx(logit(model.scores(plans)[0]) / 2)
    assert all(lower.weights[ground.name] == min(model.weights[ground.name], ground.most) for ground in GROUNDS)


@pytest.mark.slow
def test_the_bias_is_such_that_files_left_out_of_the_fit_are_right_where_they_are_sure() -> None:
    plans = made(150, 7) + real(120, 8)
    model = fit(plans)
    lowered = likeliest_model(plans).bias - model.bias
    scores, met = per_file(plans[150:], left_out_scores(plans, lowered))
    assert precision_at(scores, met, 0.8 - 1e-9) >= 0.99


def test_plans_of_one_house_stay_on_one_side() -> None:
    plans = made(400, 3)
    fitted, held_out = split(plans)
    assert not {plan.house for plan in fitted} & {plan.house for plan in held_out}
    assert len(fitted) + len(held_out) == len(plans)
    assert 0.3 < len(held_out) / len(plans) < 0.5


def open_house(*sides: str, posts: bool = False) -> FloorPlan:
    """A house of 8 x 5 m with a floor and a roof, and walls on some of its sides or posts at its corners."""
    walls = {
        "back": (0.0, 4.8, 8.0, 5.0),
        "left": (0.0, 0.0, 0.2, 4.8),
        "right": (7.8, 0.0, 8.0, 4.8),
    }
    parts = [part for side in sides for part in wall(walls[side])]
    if posts:
        parts += [box((x, y, x + 0.2, y + 0.2), 0.0, 2.5) for x in (0.0, 7.8) for y in (0.0, 4.8)]
    roof = box((0.0, 0.0, 8.0, 5.0), 2.5, 2.7)
    return plan_of(level([*parts, roof], floor=shapely.box(0, 0, 8, 5)))


@pytest.mark.parametrize(
    ("sides", "posts"), [((), True), (("back", "left"), False), (("back", "left", "right"), False)]
)
def test_an_open_house_is_proposed_and_doubtful_and_says_why(sides: tuple[str, ...], posts: bool) -> None:
    plan = open_house(*sides, posts=posts)
    assert plan.area == pytest.approx(38.0, abs=2.0)
    assert plan.provenance["notes"] == {"boundary": "floor_edge"}
    assert plan.quality.score < 0.5
    assert any("open" in reason for reason in main_grounds_in_words(plan.quality))


def test_closed_rings_in_which_nothing_shows_a_use_are_doubtful() -> None:
    """As the letter O, three times."""
    ring = trimesh.creation.annulus(r_min=1.8, r_max=2.0, height=2.5, sections=32)
    word = [ring.copy().apply_translation((4.6 * k, 0.0, 1.25)) for k in range(3)]
    plans = plan_level(level(word), PipelineConfig(), np.random.default_rng(0))
    assert len(plans) == 3
    assert max(plan.quality.score for plan in plans) < 0.5
