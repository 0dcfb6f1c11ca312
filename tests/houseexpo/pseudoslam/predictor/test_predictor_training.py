"""Training a predictor of maps: its maps and windows, the network that is written, a run, and one that goes on."""

from __future__ import annotations

import itertools
import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from houseexpo.commands.train import train
from houseexpo.dataset import open_dataset
from houseexpo.errors import ConfigError, TrainingError
from houseexpo.inference.map_prediction import NUMBERS, Network, read_network
from houseexpo.pseudoslam.benchmark.prediction import find_predictor, score_prediction
from houseexpo.pseudoslam.predictor import training
from houseexpo.pseudoslam.predictor.training import (
    CELLS,
    SNAPSHOTS,
    Explored,
    Learner,
    Samples,
    draw_cells,
    draw_walls,
    explore_house,
)
from houseexpo.pseudoslam.worlds.maps import map_house
from tests.houseexpo.pseudoslam.learning.test_chooser_training import two_rooms, write_rooms

pytestmark = pytest.mark.slow


def some_samples(n: int, rng: np.random.Generator) -> Samples:
    numbers = rng.standard_normal((n, NUMBERS)).astype(np.float16)
    truth = (numbers[:, :2] > 0.5).astype(np.float32)
    return Samples(numbers, truth, rng.uniform(0.5, 2.0, n).astype(np.float32))


def test_slopes_are_those_of_the_loss() -> None:
    rng = np.random.default_rng(0)
    learner = Learner(np.zeros(NUMBERS, np.float32), np.ones(NUMBERS, np.float32), rng)
    learner.layers = {name: value.astype(np.float64) for name, value in learner.layers.items()}  # type: ignore[misc]
    batch = some_samples(50, rng)
    only_walls = Samples(batch.numbers, batch.truth, batch.weights)
    _, slopes = learner.find_slopes(only_walls)
    for name in learner.layers:
        at = tuple(int(rng.integers(n)) for n in learner.layers[name].shape)
        if name in {"w.2", "b.2"}:
            at = (*at[:-1], 0)
        values = []
        for step in (1e-4, -1e-4):
            moved = learner.layers[name][at]
            learner.layers[name][at] = moved + step
            values.append(whole_loss(learner, batch))
            learner.layers[name][at] = moved
        assert slopes[name][at] == pytest.approx((values[0] - values[1]) / 2e-4, abs=1e-5), name


def whole_loss(learner: Learner, batch: Samples) -> float:
    """The loss by R3, written out."""
    logits = Network(learner.layers | learner.scaling)(batch.numbers).astype(np.float64)
    x = batch.numbers.astype(np.float64)
    for k in range(3):
        x = x @ learner.layers[f"w.{k}"] + learner.layers[f"b.{k}"]
        x = np.maximum(x, 0.0) if k < 2 else x
    np.testing.assert_allclose(logits, x, atol=1e-4)
    p = 1 / (1 + np.exp(-x))
    scores = -np.where(batch.truth == 1, np.log(p), np.log(1 - p))
    share = batch.weights / batch.weights.sum()
    return float((share * (scores[:, 0] + 0.3 * scores[:, 1])).sum())


def test_a_learner_learns() -> None:
    rng = np.random.default_rng(0)
    learner = Learner(np.zeros(NUMBERS, np.float32), np.ones(NUMBERS, np.float32), rng)
    losses = [learner.step(some_samples(500, rng), 1e-2) for _ in range(60)]
    assert losses[-1] < 0.4 * losses[0]
    found = Network(learner.arrays())(some_samples(1, rng).numbers)
    assert found.shape == (1, 2)


def test_maps_of_an_exploration_grow_and_agree_with_the_house() -> None:
    one = explore_house(two_rooms("a"), None, np.random.default_rng(0))
    walls, free = one.unpack(one.walls), one.unpack(one.free)
    assert not (walls & free).any()
    assert len(one.maps) == SNAPSHOTS
    known = [one.unpack(seen) | one.unpack(open_) for seen, open_ in one.maps]
    assert all((later >= earlier).all() for earlier, later in itertools.pairwise(known))
    for seen, open_ in one.maps:
        assert not (one.unpack(seen) & (1 - walls)).any()
        assert not (one.unpack(open_) & (1 - free)).any()
    assert known[-1].sum() > 0.8 * (walls | free).sum()
    cells = np.ones((40, 60), bool)
    cells[5:35, 5:55] = False
    outside = np.zeros((40, 60), np.uint8)
    outside[:3] = outside[-3:] = outside[:, :3] = outside[:, -3:] = 1
    floor = explore_house(map_house(cells, 0.1), outside, np.random.default_rng(0))
    rings = [np.count_nonzero(floor.unpack(floor.walls)[row]) for row in (2, 3, 4, 5, 20)]
    assert rings == [0, 54, 54, 4, 4]  # the outer and the inner surface of a wall of two cells


def test_drawings_of_a_building_differ_in_what_a_robot_does_not_see() -> None:
    free = np.zeros((40, 60), np.uint8)
    free[8:32, 8:25] = free[8:32, 33:52] = 1
    walls = cv2.dilate(free, np.ones((3, 3), np.uint8)) & (1 - free)
    one = Explored(40, 60, np.packbits(walls).tobytes(), np.packbits(free).tobytes(), [])
    across = set()
    for seed in range(24):
        drawn, open_ = draw_walls(one, np.random.default_rng(seed))
        assert not (drawn & open_).any()
        assert drawn[walls != 0].all()  # the surfaces that a robot sees
        assert open_[free != 0].all()
        across.add(
            "".join("#" if wall else "." if space else " " for wall, space in zip(drawn[20], open_[20], strict=True))
        )
    inner = {"#      #", "#......#", "##....##"}
    assert {line[25:33] for line in across} == inner
    assert {line[5:8] for line in across} == {"  #", "..#", ".##"}


def test_cells_are_unknown_ones_and_stand_for_all_of_them() -> None:
    one = explore_house(two_rooms("a"), None, np.random.default_rng(0))
    drawn = draw_cells(one, np.random.default_rng(1))
    assert drawn
    for samples in drawn:
        assert samples.numbers.shape == (len(samples.weights), NUMBERS)
        assert len(samples.weights) <= CELLS
        walls = samples.truth[:, 0] == 1
        assert not (walls & (samples.truth[:, 1] == 1)).any()
        assert 0 < walls.sum() <= CELLS // 3
        assert len(np.unique(samples.weights)) <= 2  # walls, and others
    first, packed = drawn[0], one.maps[0]
    unknown = (one.unpack(packed[0]) | one.unpack(packed[1])) == 0
    walls = first.truth[:, 0] == 1
    share = first.weights[walls].sum() / first.weights.sum()
    assert share == pytest.approx(one.unpack(one.walls)[unknown].mean(), rel=1e-4)


def test_a_run_goes_on_with_the_same_bits_and_learns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training, "SAVED_STEPS", 2)
    monkeypatch.setattr(training, "BATCH", 64)
    plans = open_dataset(write_rooms(tmp_path))
    ids = plans.split("train").ids
    config = training.PredictorConfig(houses=2, thick=1, floors=2, steps=6)
    whole, parts, said = tmp_path / "whole", tmp_path / "parts", list[str]()
    about = training.train_predictor(plans, ids, config, whole, resume=False, say=said.append)
    assert said[-1].startswith("6 of 6 steps: loss of walls ")
    network, found = read_network(whole / "predictor.npz")
    assert found == json.loads(json.dumps(about))
    assert (found["steps"], found["houses"], found["seed"]) == (6, 2, 0)
    assert network.layers == 3

    class KilledError(Exception):
        """Stands for the end of the process."""

    def kill(line: str) -> None:
        if line.startswith("4 of 6"):
            raise KilledError

    with pytest.raises(KilledError):
        training.train_predictor(plans, ids, config, parts, resume=False, say=kill)
    with pytest.raises(TrainingError, match="holds a run; continue it with --resume"):
        training.train_predictor(plans, ids, config, parts, resume=False, say=kill)
    training.train_predictor(plans, ids, config, parts, resume=True, say=lambda _: None)
    assert (parts / "predictor.npz").read_bytes() == (whole / "predictor.npz").read_bytes()

    other = training.PredictorConfig(houses=2, thick=1, floors=2, steps=7)
    with pytest.raises(TrainingError, match="belongs to another run"):
        training.train_predictor(plans, ids, other, parts, resume=True, say=lambda _: None)
    for name in ("state.npz", "houses-000000.msgpack"):
        broken = tmp_path / f"broken-{name}"
        shutil.copytree(parts, broken)
        (broken / name).write_bytes(b"damaged")
        with pytest.raises(TrainingError, match="damaged"):
            training.train_predictor(plans, ids, config, broken, resume=True, say=lambda _: None)
    with pytest.raises(ConfigError, match="expected 9 plans for training, found 3"):
        training.train_predictor(
            plans, ids, training.PredictorConfig(houses=9, thick=1), tmp_path / "few", resume=False, say=said.append
        )


def test_the_command_trains_a_predictor_and_refuses_what_is_not_for_it(tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(train)
    plans, config, out = write_rooms(tmp_path), tmp_path / "tiny.toml", tmp_path / "run"
    config.write_text("houses = 1\nthick = 1\nfloors = 1\n")
    done = CliRunner().invoke(
        app, ["predictor", str(plans), "--config", str(config), "--steps", "1", "--out", str(out)]
    )
    assert done.exit_code == 0, done.output
    assert read_network(out / "predictor.npz")[1]["steps"] == 1
    refused = CliRunner().invoke(app, ["predictor", str(plans), "--motion", "discrete", "--out", str(tmp_path / "b")])
    assert "leave out --motion and --threads" in str(refused.exception)


def test_the_network_that_comes_with_the_project_beats_closed_gaps_in_houses() -> None:
    found: list[tuple[float, float, float]] = []
    for seed in range(3):
        one = explore_house(two_rooms("a", 5.0 + seed), None, np.random.default_rng([5, seed]))
        occupied = 1 - one.unpack(one.free)
        for seen, open_ in one.maps[:4]:
            known = (255 * one.unpack(seen) + 127 * one.unpack(open_)).astype(np.uint8)
            if (known == 0).any():
                predictors = (find_predictor(name, 10.0) for name in ("network", "lines", "free"))
                found.append(tuple(score_prediction(predict(known), known, occupied).iou for predict in predictors))  # type: ignore[arg-type]
    network, lines, free = np.mean(found, axis=0)
    assert network > max(lines, free) + 0.02
