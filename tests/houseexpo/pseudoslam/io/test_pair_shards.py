"""Files of pairs of maps: they are whole, alike and taken up again."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import houseexpo.pseudoslam.io.pair_shards as module
from houseexpo import Dataset, open_dataset
from houseexpo.commands.observe import observe as command
from houseexpo.errors import ConfigError
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.io.pair_shards import MANIFEST, RECIPE, write_pair_shards
from houseexpo.pseudoslam.io.pairs import PairConfig
from tests.builders.simulations import HUTS, hut

COARSE = SimulatorConfig(pixels_per_metre=10.0)
SMALL = PairConfig(each=3, every=2, size_m=8.0, pixels=40, simulator=COARSE)


@pytest.fixture
def plans(tmp_path: Path) -> Dataset:
    """Three huts, and one that the robot fits nowhere in."""
    file = tmp_path / "plans" / "huts.jsonl"
    file.parent.mkdir()
    file.write_bytes(b"\n".join(map(encode, [*HUTS, hut("mouse", 0.3)])))
    return open_dataset(file)


@pytest.fixture
def shards_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "EPISODES", 2)


def files(folder: Path) -> dict[str, str]:
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(folder.iterdir())}


def test_files_hold_pairs_and_the_manifest_says_which(plans: Dataset, tmp_path: Path, shards_of_two: None) -> None:
    done = write_pair_shards(plans, tmp_path / "out", SMALL, limit=20, seed=4)
    manifest = json.loads((tmp_path / "out" / MANIFEST).read_bytes())
    assert (done.made, done.known, done.pairs) == (4, 0, manifest["pairs"])
    assert [entry["file"] for entry in manifest["shards"]] == [f"pairs-{number:06d}.npz" for number in range(4)]
    hashes, pairs, plan_ids = files(tmp_path / "out"), 0, list[str]()
    for entry in manifest["shards"]:
        assert hashes[entry["file"]] == entry["sha256"]
        with np.load(tmp_path / "out" / entry["file"]) as arrays:
            assert set(arrays) == set(manifest["arrays"])
            assert arrays["partial"].shape == (entry["pairs"], 40, 40)
            assert (arrays["partial"].reshape(entry["pairs"], 40 * 40).max(axis=1) > 0).all()
            pairs, plan_ids = pairs + entry["pairs"], plan_ids + arrays["plan_id"].tolist()
    assert pairs == done.pairs
    # seven visits, each plan one before another has two; in the hut for a mouse the robot does not fit
    visits = [plans.ids[module._order(4, number // 4, 4)[number % 4]] for number in range(7)]
    assert len(set(visits[:4])) == 4
    expected = [plan_id for number, plan_id in enumerate(visits) for _ in range(min(3, 20 - 3 * number))]
    assert plan_ids == [plan_id for plan_id in expected if plan_id != "mouse"]
    assert len(done.refused) == visits.count("mouse") > 0
    assert "fits nowhere in plan 'mouse'" in done.refused[0]


def test_the_bytes_depend_on_the_seed_alone(plans: Dataset, tmp_path: Path, shards_of_two: None) -> None:
    for name, seed in (("one", 4), ("two", 4), ("other", 5)):
        write_pair_shards(plans, tmp_path / name, SMALL, limit=12, seed=seed)
    assert files(tmp_path / "one") == files(tmp_path / "two")
    assert files(tmp_path / "one")["pairs-000000.npz"] != files(tmp_path / "other")["pairs-000000.npz"]


@pytest.mark.slow
def test_the_bytes_do_not_depend_on_how_many_work(plans: Dataset, tmp_path: Path) -> None:
    config = replace(SMALL, each=1)
    for name, workers in (("one", 1), ("three", 3)):
        write_pair_shards(plans, tmp_path / name, config, limit=350, seed=4, workers=workers)
    assert len(files(tmp_path / "one")) == 4 + 2
    assert files(tmp_path / "one") == files(tmp_path / "three")


def test_what_was_stopped_goes_on_and_what_is_damaged_is_made_again(
    plans: Dataset, tmp_path: Path, shards_of_two: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    write_pair_shards(plans, out, SMALL, limit=20, seed=4)
    whole = files(out)
    (out / MANIFEST).unlink()
    (out / "pairs-000001.npz").unlink()
    cut = out / "pairs-000002.npz"
    cut.write_bytes(cut.read_bytes()[:-200])
    (out / ".partial-abc").write_bytes(b"half a shard")
    done = write_pair_shards(plans, out, SMALL, limit=20, seed=4)
    assert (done.known, done.made) == (2, 2)
    (out / ".partial-abc").unlink()
    assert files(out) == whole
    monkeypatch.setattr(module, "write_atomically", interrupted)
    (out / "pairs-000001.npz").unlink()
    with pytest.raises(KeyboardInterrupt):
        write_pair_shards(plans, out, SMALL, limit=20, seed=4)
    assert not (out / MANIFEST).exists()


def interrupted(*_: object) -> None:
    raise KeyboardInterrupt


def test_the_size_is_that_of_the_shards_whatever_else_the_folder_holds(plans: Dataset, tmp_path: Path) -> None:
    write_pair_shards(plans, tmp_path / "out", SMALL, limit=2, seed=4)
    (tmp_path / "out" / "map.pgm").write_bytes(bytes(100_000))
    done = write_pair_shards(plans, tmp_path / "out", SMALL, limit=2, seed=4)
    assert done.size == (tmp_path / "out" / "pairs-000000.npz").stat().st_size


def test_a_folder_holds_pairs_of_one_recipe(plans: Dataset, tmp_path: Path) -> None:
    out = tmp_path / "out"
    write_pair_shards(plans, out, SMALL, limit=2, seed=4)
    before = files(out)
    for given, said in (
        ({"seed": 5}, "'seed' in recipe.json: 4 there, 5 asked for"),
        ({"limit": 3}, "'limit' in recipe.json: 2 there, 3 asked for"),
        (
            {"config": replace(SMALL, every=SMALL.every + 1)},
            f"'config.every' in recipe.json: {SMALL.every} there, {SMALL.every + 1} asked for",
        ),
        ({"plans": plans[:1]}, "'plans.number' in recipe.json"),
    ):
        with pytest.raises(ConfigError, match=f"same recipe, found a different {said}.*; name another folder"):
            write_pair_shards(**{"plans": plans, "out": out, "config": SMALL, "limit": 2, "seed": 4, **given})
    assert files(out) == before
    (out / RECIPE).write_text("{")
    with pytest.raises(ConfigError, match=r"recipe.json: expected JSON"):
        write_pair_shards(plans, out, SMALL, limit=2, seed=4)
    (out / RECIPE).unlink()
    with pytest.raises(ConfigError, match=r"expected an empty folder or a former run, found manifest\.json"):
        write_pair_shards(plans, out, SMALL, limit=2, seed=4)


def test_the_command_says_what_it_did(plans: Dataset, tmp_path: Path) -> None:
    app = typer.Typer()
    app.command()(command)
    words = [str(plans.path), "--out", str(tmp_path / "out"), "--limit", "8", "--each", "2", "--pixels", "32"]
    result = CliRunner().invoke(app, [*words, "--workers", "1", "--noise"], catch_exceptions=False)
    assert result.exit_code == 0
    assert f"6 pairs in {tmp_path / 'out'}: 1 shard made, 0 known" in result.output
    assert "no pairs: robot.radius_m: a robot of radius 0.2 m fits nowhere in plan 'mouse'" in result.output
    assert json.loads((tmp_path / "out" / RECIPE).read_bytes())["config"]["simulator"]["noise"]["laser_m"] == 0.02


def test_no_pairs_at_all_are_refused(plans: Dataset, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="limit: expected at least 1 pair, found 0"):
        write_pair_shards(plans, tmp_path / "out", SMALL, limit=0)
