"""A person reviews houses of one kind, fits weights with one command, and builds others of the kind with them."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
import trimesh

pytest.importorskip("starlette")

from typer.testing import CliRunner, Result

from houseexpo import build, open_dataset
from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError
from houseexpo.service.collection import Collection
from houseexpo.service.review.requests import DecisionRequest
from houseexpo.service.review.session import Review
from pipeline.stages.logistic import read_model_weights
from tests.builders.batch import contents
from tests.builders.houses import Hole, shell

DOOR_M = 1.2
"""In this kind of houses all openings are doors up to this width, and shop windows down to the floor above it."""


def write_shop(path: Path, number: int) -> None:
    """A hall with a door and a window that reaches the floor, without its glass: both look like entrances."""
    rng = np.random.default_rng([7, number])
    widths = rng.uniform((0.8, 2.3), (1.1, 2.8)).round(2).tolist()
    starts = rng.permutation([0.6, 4.6]).tolist()
    front = [Hole(start, round(start + width, 2)) for start, width in zip(starts, widths, strict=True)]
    walls = shell((0.0, 0.0, float(rng.uniform(8, 11)), float(rng.uniform(4, 6))), front=front)
    path.parent.mkdir(parents=True, exist_ok=True)
    trimesh.util.concatenate(walls).export(path)


def command(*words: object) -> Result:
    return CliRunner().invoke(make_app(), [str(word) for word in words])


def review_all(folder: Path) -> None:
    """Say of each wide opening that it is a window, and keep the house."""
    review, seen = Review(Collection("plans", folder)), 0
    for name in review.queue.order:
        plan = review.queue.dataset[name]
        for door in plan.doors:
            if door.width > DOOR_M:
                middle = np.asarray(door.segment).mean(axis=0)
                review.decide(DecisionRequest(name, "window", "ann", seen=seen, points=[tuple(middle.tolist())]), "ann")
                seen += 1
        review.decide(DecisionRequest(name, "keep", "ann", seen=seen), "ann")
        seen += 1


@pytest.mark.slow
def test_from_reviewed_houses_to_plans_by_ones_own_weights(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    for k in range(16):
        write_shop(tmp_path / "shops" / f"shop{k:02}.ply", k)
    for k in range(16, 19):
        write_shop(tmp_path / "others" / f"shop{k}.ply", k)
    plans, labels, mine = tmp_path / "plans", tmp_path / "labels.jsonl", tmp_path / "mine.toml"
    build(tmp_path / "shops", plans, workers=1)
    review_all(plans)
    assert command("labels", plans, "--out", labels).exit_code == 0

    done = command("fit", labels, "--out", mine, "--workers", 2)
    assert done.exit_code == 0, done.output
    assert "16 labelled houses" in done.output
    assert f"houseexpo build SOURCE --out OUT --weights {mine}" in done.output.replace("\n", "")
    assert "entrance" in read_model_weights(mine)
    again = tmp_path / "again.toml"
    assert command("fit", labels, "--out", again, "--workers", 1).exit_code == 0
    assert again.read_bytes() == mine.read_bytes()

    shipped, own = tmp_path / "shipped", tmp_path / "own"
    build(tmp_path / "others", shipped, workers=1)
    assert [len(plan.doors) for plan in open_dataset(shipped)] == [2, 2, 2]
    was = contents(shipped)
    done = command("build", tmp_path / "others", "--out", own, "--weights", mine, "--workers", 1)
    assert done.exit_code == 0, done.output
    found = open_dataset(own)
    assert [[door.width < DOOR_M for door in plan.doors] for plan in found] == [[True]] * 3

    told = json.loads((own / "manifest.json").read_text())["parameters"]["weights"]
    assert told == {
        name: {"bias": model.bias, "weights": model.weights} for name, model in read_model_weights(mine).items()
    }
    record = json.loads((own / ".build" / "command.json").read_text())
    assert record["build"]["options"]["weights"] == str(mine)

    # plans by other weights are not taken for these, and the folder of others is as it was
    with pytest.raises(ConfigError, match="holds a build with other parameters"):
        build(tmp_path / "others", own, workers=1)
    build(tmp_path / "others", own, workers=1, others="replace")
    assert [len(plan.doors) for plan in open_dataset(own)] == [2, 2, 2]
    assert "weights" not in json.loads((own / "manifest.json").read_text())["parameters"]
    assert contents(own) == was == contents(shipped)
    build(tmp_path / "others", own, workers=2, weights=mine, others="replace")
    assert [len(plan.doors) for plan in open_dataset(own)] == [1, 1, 1]

    text = mine.read_text().replace("[entrance.weights]", "[entrance.weights]\nphase_of_the_moon = 1.0")
    (tmp_path / "other.toml").write_text(text)
    with pytest.raises(ConfigError, match="no such feature"):
        build(tmp_path / "others", own, weights=tmp_path / "other.toml")

    # too few of them: nothing is written, and the sentence says what to do
    few = tmp_path / "few.jsonl"
    few.write_bytes(b"".join(labels.read_bytes().splitlines(keepends=True)[:3]))
    done = command("fit", few, "--out", tmp_path / "few.toml")
    assert done.exit_code == 2
    assert "of 10 houses or more, found 3 houses; review more of them" in done.output.replace("\n", " ")
    assert not (tmp_path / "few.toml").exists()
    (line,) = few.read_bytes().splitlines()[:1]
    assert msgspec.json.decode(line)["reader"] == "mesh_file"
