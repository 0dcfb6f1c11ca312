"""IoU of predicted maps on tiny ones whose IoU is counted by hand, and on the way along a corridor."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.comparison import read_results
from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner
from houseexpo.pseudoslam.benchmark.prediction import (
    PredictionScorer,
    check_predicted_map,
    find_judged_cells,
    predict_free,
    predict_solid,
    predict_walls_in_gaps,
    score_prediction,
)
from houseexpo.pseudoslam.benchmark.result import write_result
from houseexpo.pseudoslam.benchmark.run import RunSettings, run_benchmark
from houseexpo.pseudoslam.benchmark.tables import format_markdown
from houseexpo.pseudoslam.benchmark.tracks import find_track
from tests.builders.policies import CORRIDOR, TINY, forward, named
from tests.builders.simulations import hut
from tests.houseexpo.pseudoslam.benchmark.test_benchmark_cases import data_set

VALUES = {"?": 0, ".": 127, "#": 255}


def grid(*rows: str) -> np.ndarray[Any, np.dtype[np.uint8]]:
    return np.array([[VALUES[cell] for cell in row] for row in rows], np.uint8)


TRUTH = grid(
    "######",
    "#....#",
    "#....#",
    "######",
    "######",
)
KNOWN = grid(
    "###???",
    "#..???",
    "#..???",
    "###???",
    "??????",
)
"""The robot has seen the left half: 3 + 1 + 1 + 3 walls of 16, and 4 of 8 free cells."""


def test_the_last_row_is_inside_the_wall_and_is_not_judged() -> None:
    judged = find_judged_cells((TRUTH == 255).astype(np.uint8))
    assert judged[:4].all()
    assert not judged[4].any()


def test_a_map_alone_has_the_share_of_the_walls_that_it_knows() -> None:
    scores = score_prediction(KNOWN, KNOWN, TRUTH == 255)
    assert scores.iou == pytest.approx(8 / 16)
    assert scores.iou_unseen_walls == 0.0
    assert scores.iou_unseen_free == pytest.approx(4 / 12)  # unknown counts as free: 12 unseen cells, 4 are free
    assert score_prediction(predict_free(KNOWN), KNOWN, TRUTH == 255) == scores


def test_solid_is_right_about_all_walls_and_wrong_about_all_free_cells() -> None:
    scores = score_prediction(predict_solid(KNOWN), KNOWN, TRUTH == 255)
    assert scores.iou == pytest.approx(16 / 20)
    assert scores.iou_unseen_walls == pytest.approx(8 / 12)
    assert scores.iou_unseen_free == 0.0


def test_the_truth_itself_has_1_and_one_wrong_cell_is_one_of_the_union() -> None:
    truth = TRUTH == 255
    assert score_prediction(TRUTH, KNOWN, truth).iou == 1.0
    predicted = TRUTH.copy()
    predicted[1, 4] = 255
    scores = score_prediction(predicted, KNOWN, truth)
    assert scores.iou == pytest.approx(16 / 17)
    assert scores.iou_unseen_walls == pytest.approx(8 / 9)
    assert scores.iou_unseen_free == pytest.approx(3 / 4)


def test_the_tolerant_iou_is_that_of_a_loop_over_cells() -> None:
    """PIPE's definition, cell by cell: walls in both maps may lie two rows and columns apart."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        truth, predicted = (rng.random((2, 30, 40)) < 0.02).astype(np.uint8)
        judged = rng.random(truth.shape) < 0.03
        hits = false = missed = 0
        for row, col in np.ndindex(truth.shape):
            near = np.s_[max(row - 2, 0) : row + 3, max(col - 2, 0) : col + 3]
            if not judged[near].any():
                continue
            hits += bool(truth[row, col] and predicted[near].any())
            missed += bool(truth[row, col] and not predicted[near].any())
            false += bool(predicted[row, col] and not truth[near].any())
        scores = score_prediction(np.where(predicted, 255, 127).astype(np.uint8), np.zeros_like(truth), truth, judged)
        assert scores.iou_tolerant == hits / (hits + false + missed)


def test_two_cells_beside_a_wall_are_near_enough_and_three_are_not() -> None:
    truth = np.zeros((20, 20), bool)
    truth[10] = True
    for shift, score in ((0, 1.0), (2, 1.0), (3, 0.0)):
        predicted = np.where(np.roll(truth, shift, axis=0), 255, 127).astype(np.uint8)
        assert score_prediction(predicted, predicted, truth).iou_tolerant == score


def test_nothing_unseen_has_no_score_there() -> None:
    scores = score_prediction(TRUTH, TRUTH, TRUTH == 255)
    assert (scores.iou, scores.iou_unseen_walls, scores.iou_unseen_free) == (1.0, None, None)


def test_lines_close_short_gaps_of_unknown_cells_only() -> None:
    known = grid(
        "##??##",
        "??????",
        "##..##",
        "??????",
        "?????#",
    )
    assert np.array_equal(
        predict_walls_in_gaps(known, 2),
        grid(
            "######",
            "##..##",
            "##..##",
            ".....#",
            ".....#",
        ),
    )
    far = grid("##???##")
    assert np.array_equal(predict_walls_in_gaps(far, 2), grid("##...##"))
    assert np.array_equal(predict_walls_in_gaps(far, 3), grid("#######"))


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (None, r"predicted_map: expected an array uint8 \(5, 6\), found None"),
        (TRUTH[:4], r"expected an array uint8 \(5, 6\), found uint8 \(4, 6\)"),
        (TRUTH.astype(np.float64), r"found float64 \(5, 6\)"),
        (np.where(TRUTH == 127, 100, TRUTH).astype(np.uint8), r"127 \(free\) or 255 \(obstacle\), found 100"),
    ],
)
def test_what_is_no_map_is_refused(found: object, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        check_predicted_map(found, (5, 6))


def test_the_map_within_a_budget_counts_and_the_last_one_after_the_end() -> None:
    seen: list[int] = []

    def predict(info: Any) -> Any:
        seen.append(info["steps"])
        return info["map"]

    scoring = PredictionScorer(predict, (TRUTH == 255).astype(np.uint8), (1, 2, 5))
    for step, metres in enumerate((0.0, 0.6, 1.0, 2.4)):
        scoring.add(metres, {"map": KNOWN, "steps": step})
    values = scoring.values()
    assert seen == [2, 2, 3]  # at 1.0 m, which is within 1 and 2 metres; then the last one
    assert values["iou_1_metres"] == pytest.approx(0.5)
    assert list(values) == [
        f"{part}_{b}_metres"
        for b in (1, 2, 5)
        for part in ("iou", "iou_tolerant", "iou_unseen_walls", "iou_unseen_free")
    ]


def test_along_a_corridor_more_and_more_walls_are_known() -> None:
    """Its walls are 28 m long; 2 x 1.73 m of them are within 1 m at the start, and 0.6 m more with each step."""
    found = EpisodeRunner(TINY, named(forward), [CORRIDOR], prediction="free").run(Case("corridor", 5)).values
    more = found["iou_20_metres"] - found["iou_10_metres"]
    assert found["iou_10_metres"] == pytest.approx(2 * (9.9 + 2 * math.sqrt(0.75)) / 28, abs=0.03)
    assert more > 0.05
    assert found["iou_unseen_walls_10_metres"] == 0.0
    without = EpisodeRunner(TINY, named(forward), [CORRIDOR]).run(Case("corridor", 5)).values
    assert without == {key: value for key, value in found.items() if not key.startswith("iou")}


class Solid:
    """Goes ahead, and takes all that is unknown for walls."""

    def __init__(self, _robot: Any, _seed: int) -> None: ...

    def __call__(self, _observation: Any, _info: Any) -> int:
        return 0

    def predicted_map(self, info: Any) -> Any:
        return np.where(info["map"] == 0, 255, info["map"]).astype(np.uint8)


class Wrong(Solid):
    def predicted_map(self, info: Any) -> Any:
        return info["map"][1:]


def test_a_policy_predicts_itself() -> None:
    own = EpisodeRunner(TINY, named(Solid), [CORRIDOR], prediction="policy").run(Case("corridor", 5))
    solid = EpisodeRunner(TINY, named(forward), [CORRIDOR], prediction="solid").run(Case("corridor", 5))
    assert own.values == solid.values
    with pytest.raises(PolicyError, match=r"predicted_map: expected an array uint8 \(.*\), found uint8"):
        EpisodeRunner(TINY, named(Wrong), [CORRIDOR], prediction="policy").run(Case("corridor", 5))


def test_tracks_without_budgets_and_unknown_names_are_refused() -> None:
    with pytest.raises(ConfigError, match="one of policy, free, solid, lines, network, network-tolerant; found 'fre'"):
        EpisodeRunner(TINY, named(forward), [CORRIDOR], prediction="fre")
    with pytest.raises(
        ConfigError, match=r"--prediction policy: expected policy 'mine' to have a method predicted_map"
    ):
        EpisodeRunner(TINY, named(forward), [CORRIDOR], prediction="policy").run(Case("corridor", 5))
    with pytest.raises(ConfigError, match="track exploration-quality-v1 has no budget of metres"):
        EpisodeRunner(find_track("quality"), named(forward), [CORRIDOR], prediction="free").run(Case("corridor", 5))


@pytest.mark.slow
def test_results_have_a_table_of_predictions(tmp_path: Path) -> None:
    plans = data_set(tmp_path / "plans", {"test": [hut(f"hut_{side}", float(side)) for side in (3, 4)]})
    for name in ("", "solid"):
        result = run_benchmark(find_track("budget"), "forward", plans, RunSettings(number=2, prediction=name))
        write_result(result, tmp_path / f"forward{name}.json")
        assert ("iou_100_metres" in result.summary) == bool(name)
    assert '"prediction"' not in (tmp_path / "forward.json").read_text()
    text = format_markdown(read_results([tmp_path / "forward.json", tmp_path / "forwardsolid.json"]))
    assert "| policy | IoU, 100 metres |" in text
    assert "| forward, prediction solid |" in text
