"""Learning to choose frontiers: what is tried, what is told of it, and a run from beginning to end."""

from __future__ import annotations

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
from houseexpo.errors import ConfigError, TrainingError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.planning.outlook import LOOKED_AT, OUTLOOKS
from houseexpo.pseudoslam.kernels.planning.scoring import best_of
from houseexpo.pseudoslam.learning.choice_net import fit
from houseexpo.pseudoslam.learning.choices import TRIED, Choices, choices_in
from houseexpo.pseudoslam.learning.choosing import INFORMATION, WEIGHTS, ChoosingConfig, train_chooser
from houseexpo.pseudoslam.learning.explorations import Explorations
from houseexpo.pseudoslam.learning.weights import read_weights

CONFIG = SimulatorConfig(pixels_per_metre=12.5)


def two_rooms(name: str, width: float = 6.0) -> FloorPlan:
    """Two rooms of 6 m by so wide, with a gap of a metre between them."""
    far, wall = 2 * width + 0.2, width + 0.2
    verts = [(0, 0), (0, 6), (width, 6), (width, 3.4), (wall, 3.4), (wall, 6), (far, 6), (far, 0)]
    return FloorPlan(name, [*verts, (wall, 0), (wall, 2.4), (width, 2.4), (width, 0)], 2, {})


ROOMS, TRAIN = two_rooms("rooms"), ("rooms_a", "rooms_b", "rooms_c")
TINY = ChoosingConfig(rounds=2, plans=1, more_plans=1, tested=1, steps=200)


def write_rooms(folder: Path) -> Path:
    """Write a data set of three plans, and its list; return its folder."""
    plans = folder / "rooms"
    (plans / "splits").mkdir(parents=True)
    for number, name in enumerate(TRAIN):
        (plans / f"{name}.json").write_bytes(encode(two_rooms(name, 6.0 + number)))
    (plans / "splits" / "train.txt").write_text("".join(f"{name}\n" for name in TRAIN))
    return plans


def test_every_frontier_that_is_tried_has_a_worth() -> None:
    found = choices_in(Explorations(CONFIG, 200), ROOMS, INFORMATION, np.random.default_rng(4))
    assert len(found) >= 1
    assert (found.tried.sum(axis=1) >= 2).all()
    for one in range(len(found)):
        n = int(found.tried[one].sum())
        assert found.tried[one].tolist() == [place < n for place in range(TRIED)]
        assert ((found.worth[one, :n, 0] > 0) & (found.worth[one, :n, 0] <= 1)).all()
        assert (found.worth[one, :n, 1] >= 0).all()
        assert len({tuple(row) for row in found.outlooks[one, :n].tolist()}) == n
    again = choices_in(Explorations(CONFIG, 200), ROOMS, INFORMATION, np.random.default_rng(4))
    assert np.array_equal(found.worth, again.worth)
    assert np.array_equal(found.outlooks, again.outlooks)


def made_choices(number: int, rng: np.random.Generator) -> Choices:
    """Area is better for a large first number, metres for a small second one; noise on both."""
    outlooks = rng.normal(3.0, 2.0, (number, TRIED, len(OUTLOOKS)))
    tried = np.arange(TRIED) < rng.integers(2, TRIED + 1, (number, 1))
    area = 0.01 * outlooks[..., 0] + rng.normal(0, 0.005, tried.shape)
    metres = 2.0 * outlooks[..., 1] + rng.normal(0, 1.0, tried.shape)
    worth = np.stack([area, metres], axis=2) + rng.normal(0, 5.0, (number, 1, 2))  # what all share counts for nothing
    return Choices(outlooks, tried, worth)


def share_of_best(share: float, key: int, sign: float) -> float:
    """How often the net's choice is the best by a worth, among choices that it has not seen."""
    rng = np.random.default_rng(0)
    scorer = fit(made_choices(1500, rng), rng, epochs=20).mixed(share)
    tests, scores = made_choices(200, rng), np.zeros(LOOKED_AT)
    right = 0
    for outlooks, tried, worth in zip(tests.outlooks, tests.tried, tests.worth, strict=True):
        n = int(tried.sum())
        padded = np.zeros((LOOKED_AT, len(OUTLOOKS)))
        padded[:n] = outlooks[:n]
        right += best_of(padded, n, scorer, scores) == int((sign * worth[:n, key]).argmax())
    return right / len(tests)


def test_the_net_tells_which_choice_is_best() -> None:
    assert share_of_best(1.0, 0, 1.0) > 0.7
    assert share_of_best(0.0, 1, -1.0) > 0.6
    assert share_of_best(1.0, 1, -1.0) < 0.5


def test_a_run_that_was_stopped_ends_with_the_same_weights(tmp_path: Path) -> None:
    plans, said = open_dataset(write_rooms(tmp_path)), list[str]()
    config = replace(TINY, plans=1)
    train_chooser(plans, TRAIN, config, tmp_path / "whole", resume=False, say=said.append)
    weights = (tmp_path / "whole" / WEIGHTS).read_bytes()
    assert any("round 1" in line for line in said)
    scorer, about = read_weights(tmp_path / "whole" / WEIGHTS)
    assert scorer.first.any()
    assert about["seed"] == 0
    assert len(about["tests"]) == 2 + 2 * 5
    shutil.copytree(tmp_path / "whole", tmp_path / "stopped")
    (tmp_path / "stopped" / "round-1.npz").unlink()
    (tmp_path / "stopped" / WEIGHTS).unlink()
    with pytest.raises(TrainingError, match="holds a run; go on with it by --resume"):
        train_chooser(plans, TRAIN, config, tmp_path / "stopped", resume=False, say=said.append)
    with pytest.raises(TrainingError, match="holds another run than was asked for"):
        train_chooser(plans, TRAIN, replace(config, seed=1), tmp_path / "stopped", resume=True, say=said.append)
    train_chooser(plans, TRAIN, config, tmp_path / "stopped", resume=True, say=said.append)
    assert (tmp_path / "stopped" / WEIGHTS).read_bytes() == weights
    (tmp_path / "stopped" / "round-0.npz").write_bytes(b"PK")
    with pytest.raises(TrainingError, match=r"round-0.npz: expected choices of a run, found it damaged"):
        train_chooser(plans, TRAIN, config, tmp_path / "stopped", resume=True, say=said.append)


def test_too_few_plans_are_refused_before_a_run_begins(tmp_path: Path) -> None:
    plans = open_dataset(write_rooms(tmp_path))
    with pytest.raises(ConfigError, match="expected 6 plans to learn from and to be tested on, found 3"):
        train_chooser(plans, TRAIN, replace(TINY, plans=4), tmp_path / "run", resume=False, say=print)
    assert not (tmp_path / "run").exists()


def called(*words: Any) -> Any:
    app = typer.Typer()
    app.command()(train)
    return CliRunner().invoke(app, ["chooser", *map(str, words)])


def test_the_command_takes_a_file_and_a_seed(tmp_path: Path) -> None:
    file, out = tmp_path / "tiny.toml", tmp_path / "run"
    file.write_text("rounds = 1\nplans = 1\ntested = 1\nsteps = 200\n")
    done = called("--out", out, "--dataset", write_rooms(tmp_path), "--config", file, "--seed", 3)
    assert done.exit_code == 0, done.output
    assert "round 0, choices" in done.output
    assert read_weights(out / WEIGHTS)[1]["seed"] == 3


@pytest.mark.parametrize(
    ("lines", "words", "said"),
    [
        ("", ["--steps", "5"], "--steps and --threads are not for it"),
        ("speed = 1", [], "unknown key 'speed'; known: seed, rounds"),
        ("plans = 0", [], "plans: expected a whole number of at least 1"),
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
