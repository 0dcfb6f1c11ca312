"""The learned chooser: its weights' files, and that they score what is written down."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

from houseexpo.dataset import open_dataset
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.learned import chooser_weights_path
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.benchmark.result import read_result
from houseexpo.pseudoslam.benchmark.run import RunSettings, run_benchmark
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.learning.chooser_training import NEAREST
from houseexpo.pseudoslam.learning.weights import read_weights, round_weights, write_weights
from tests.builders.shared import DATA, needs_shared

RESULTS = Path(__file__).parents[4] / "experiments" / "chooser-20-plans"
SEEDS = {"chooser": 0, "chooser-1": 1, "chooser-2": 2}


@pytest.mark.parametrize("name", SEEDS)
def test_weights_come_with_what_made_them(name: str) -> None:
    file = chooser_weights_path(SEEDS[name])
    assert file.stat().st_size < 200_000
    weights, about = read_weights(file)
    assert about["seed"] == SEEDS[name]
    assert len(about["commit"]) >= 40
    assert weights.any()
    policy = load_policy(name)
    assert policy.training == load_policy(str(file)).training
    assert (policy.training.family, policy.training.seed) == ("chooser", SEEDS[name])  # type: ignore[union-attr]
    assert policy.sha256 == load_policy(str(file)).sha256


def test_the_finisher_is_a_family_of_its_own() -> None:
    policy = load_policy("finisher")
    assert (policy.training.family, policy.training.seed) == ("finisher", 0)  # type: ignore[union-attr]
    assert policy.sha256 != load_policy("chooser").sha256


def test_weights_are_read_as_they_were_written(tmp_path: Path) -> None:
    weights = round_weights(np.random.default_rng(0).normal(0, 1, len(NEAREST)))
    write_weights(tmp_path / "mine.json", weights, {"seed": 7})
    again, about = read_weights(tmp_path / "mine.json")
    assert np.array_equal(weights, again)
    assert about == {"seed": 7}
    training = load_policy(str(tmp_path / "mine.json")).training
    assert training is not None
    assert training.seed == 7


def test_what_holds_no_weights_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "mine.json"
    write_weights(file, NEAREST, {})
    good = json.loads(file.read_bytes())
    assert good["weights"] == {"rank": -1.0}
    for change, said in (
        ({"format": "houseexpo chooser 1"}, "expected 'houseexpo chooser 2', found .*; train it again"),
        ({"weights": {"way": 1.0, "weather": 2.0}}, "expected weights of way, log way, .*; found one of 'weather'"),
        ({"weights": {"way": 1e999}}, "way: expected a finite number|expected weights of"),
        ({"weights": {"way": "far"}}, "expected weights of `houseexpo train chooser`, found none"),
        ({"weights": None}, "expected weights of `houseexpo train chooser`, found none"),
    ):
        file.write_text(json.dumps({**good, **change}))
        with pytest.raises(ConfigError, match=said):
            read_weights(file)
    file.write_text("{")
    with pytest.raises(ConfigError, match=r"mine.json: expected weights of `houseexpo train chooser`, found none"):
        load_policy(str(file))
    with pytest.raises(ConfigError, match="expected a file, found none"):
        load_policy(str(tmp_path / "none.json"))


@pytest.mark.slow
@needs_shared
@pytest.mark.parametrize("track", ["budget", "quality"])
@pytest.mark.parametrize("name", SEEDS)
def test_weights_score_what_is_written_down(name: str, track: str) -> None:
    """Twenty plans, the first of the benchmark's: every value of every episode, but for rounding."""
    told = read_result(RESULTS / f"{find_track(track).id}-{name}.json")
    plans = open_dataset(DATA / "houseexpo" / "plans_33717.jsonl.gz")
    found = run_benchmark(find_track(track), name, plans, RunSettings(number=20, workers=min(os.cpu_count() or 1, 2)))
    assert found.policy.sha256 == told.policy.sha256
    for key, values in found.episodes.items():
        wanted = told.episodes[key]
        assert values == wanted if key == "plan" else values == pytest.approx(wanted, abs=1e-6), key
