"""Learning to choose frontiers: the search, what a candidate costs, and a run from beginning to end."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from houseexpo.commands.train import train
from houseexpo.dataset import open_dataset
from houseexpo.errors import ConfigError, MissingDependencyError, TrainingError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.kernels.planning.frontier_features import FEATURES
from houseexpo.pseudoslam.learning.chooser_training import (
    INFORMATION,
    SPREADS,
    WEIGHTS,
    ChooserConfig,
    CmaEsSearch,
    _costs,
    train_chooser,
)
from houseexpo.pseudoslam.learning.weights import read_weights
from tests.builders.needs import need


def two_rooms(name: str, width: float = 6.0) -> FloorPlan:
    """Two rooms of 6 m by so wide, with a gap of a metre between them."""
    far, wall = 2 * width + 0.2, width + 0.2
    verts = [(0, 0), (0, 6), (width, 6), (width, 3.4), (wall, 3.4), (wall, 6), (far, 6), (far, 0)]
    return FloorPlan(name, [*verts, (wall, 0), (wall, 2.4), (width, 2.4), (width, 0)], 2, {})


TRAIN = ("rooms_a", "rooms_b", "rooms_c")
TINY = ChooserConfig(generations=3, candidates=4, plans=2, tested=1, steps=200)


def need_cma() -> None:
    need(modules=["cma"], how="make learn")


def write_rooms(folder: Path) -> Path:
    """Write a data set of three plans, and its list; return its folder."""
    plans = folder / "rooms"
    (plans / "splits").mkdir(parents=True)
    for number, name in enumerate(TRAIN):
        (plans / f"{name}.json").write_bytes(encode(two_rooms(name, 6.0 + number)))
    (plans / "splits" / "train.txt").write_text("".join(f"{name}\n" for name in TRAIN))
    return plans


def global_state() -> bytes:
    """What NumPy's own generator would go on with."""
    state: Any = np.random.get_state()  # noqa: NPY002  # that it is left alone is what is looked at
    return bytes(state[1].tobytes() + bytes([state[2] % 256]))


def test_the_search_finds_weights_of_which_the_best_are_known() -> None:
    """Cost: how far three of the weights, in their spreads, are from what they should be; noise on it."""
    need_cma()
    wanted = {"way": -3.0, "turn": 1.0, "log length": 2.0}
    noise = np.random.default_rng(1)

    def cost(weights: np.ndarray) -> float:
        off = [weights[FEATURES.index(name)] * SPREADS[name] - value for name, value in wanted.items()]
        return float(np.square(off).sum() + noise.normal(0, 0.05))

    search, before = CmaEsSearch(np.zeros(len(FEATURES)), 12, seed=0), global_state()
    for _ in range(60):
        search.tell([cost(weights) for weights in search.ask()])
    assert cost(search.mean) < 0.5  # 14 where it began
    assert search.mean[FEATURES.index("steps")] == 0.0
    assert global_state() == before


def test_costs_are_shares_of_the_root_of_what_nearest_frontier_needs() -> None:
    ways = np.zeros((2, 4, 2))  # two houses; two candidates, the mean, nearest frontier
    ways[0, :, 0], ways[1, :, 0] = (10.0, 20.0, 0.0, 24.0), (5.0, 5.0, 0.0, 0.0)
    ways[..., 1] = 100.0
    assert _costs(ways, 0.01) == pytest.approx([(11 / 26**0.5 + 6 / 2**0.5) / 2, (21 / 26**0.5 + 6 / 2**0.5) / 2])


@pytest.mark.slow
def test_a_run_that_was_stopped_ends_with_the_same_weights(tmp_path: Path) -> None:
    need_cma()
    plans, said = open_dataset(write_rooms(tmp_path)), list[str]()

    def learn(folder: str, config: ChooserConfig = TINY, threads: int = 1, *, resume: bool = False) -> bytes:
        train_chooser(plans, TRAIN, config, tmp_path / folder, resume=resume, threads=threads, say=said.append)
        return (tmp_path / folder / WEIGHTS).read_bytes()

    weights = learn("whole")
    assert any("generation 3 of 3" in line for line in said)
    found, about = read_weights(tmp_path / "whole" / WEIGHTS)
    assert np.abs(found - INFORMATION).max() > 0.01
    assert about["seed"] == 0
    assert set(about["tests"]) == {"learned", "information", "nearest"}
    assert 0 < about["tests"]["nearest"]["metres"] < 30
    assert learn("threads", threads=2) == weights
    assert learn("other", replace(TINY, seed=1)) != weights
    shutil.copytree(tmp_path / "whole", tmp_path / "stopped")
    costs = tmp_path / "stopped" / "costs.json"
    costs.write_text(json.dumps(json.loads(costs.read_bytes())[:1]))
    with pytest.raises(TrainingError, match="holds a run; continue it with --resume"):
        learn("stopped")
    with pytest.raises(TrainingError, match="belongs to another run"):
        learn("stopped", replace(TINY, seed=1), resume=True)
    said.clear()
    assert learn("stopped", resume=True) == weights
    assert [line[:17] for line in said[:2]] == ["generation 2 of 3", "generation 3 of 3"]
    for damaged in ("[[1.0,", "[[1.0, 2.0]]", "[[1, 2, 3, null]]"):
        costs.write_text(damaged)
        with pytest.raises(TrainingError, match=r"costs.json: expected costs of .*; delete it"):
            learn("stopped", resume=True)


def test_too_few_plans_are_refused_before_a_run_begins(tmp_path: Path) -> None:
    plans = open_dataset(write_rooms(tmp_path))
    need_cma()
    with pytest.raises(ConfigError, match="expected 6 plans for training and testing, found 3"):
        train_chooser(plans, TRAIN, replace(TINY, plans=5), tmp_path / "run", resume=False, threads=1, say=print)
    assert not (tmp_path / "run").exists()


def called(*words: Any) -> Any:
    app = typer.Typer()
    app.command()(train)
    return CliRunner().invoke(app, ["chooser", *map(str, words)])


def test_the_command_takes_a_file_and_a_seed(tmp_path: Path) -> None:
    file, out = tmp_path / "tiny.toml", tmp_path / "run"
    need_cma()
    file.write_text("generations = 1\ncandidates = 4\nplans = 1\ntested = 1\nsteps = 200\n")
    done = called("--out", out, write_rooms(tmp_path), "--config", file, "--seed", 3, "--threads", 2)
    assert done.exit_code == 0, done.output
    assert "generation 1 of 1" in done.output
    assert read_weights(out / WEIGHTS)[1]["seed"] == 3


@pytest.mark.parametrize(
    ("lines", "words", "said"),
    [
        ("", ["--steps", "5"], "--steps is not for it"),
        ("speed = 1", [], "unknown key 'speed'; did you mean 'seed'? Known: seed, generations"),
        ("plans = 0", [], "plans: expected a whole number of at least 1"),
        ("candidates = 3", [], "candidates: expected a whole number of at least 4"),
        ("step_m = -1.0", [], "step_m: expected at least 0"),
        ("pixels_per_metre = 0", [], "pixels_per_metre: expected more than 0"),
    ],
)
def test_what_cannot_be_learned_is_refused(tmp_path: Path, lines: str, words: list[str], said: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(lines)
    done = called("--out", tmp_path / "run", "--config", file, *words)
    assert isinstance(done.exception, ConfigError)
    assert said in str(done.exception)
    assert not (tmp_path / "run").exists()


def test_without_the_library_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("houseexpo.pseudoslam.learning.chooser_training.find_spec", lambda _: None)
    plans = open_dataset(write_rooms(tmp_path))
    with pytest.raises(MissingDependencyError, match=r"needs cma, not installed here: .*learn"):
        train_chooser(plans, TRAIN, TINY, tmp_path / "run", resume=False, threads=1, say=print)
    assert not (tmp_path / "run").exists()
