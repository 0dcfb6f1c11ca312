"""``houseexpo train``: what it refuses before anything is learned, and a small run of the paper's experiments."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from houseexpo.commands.export import export
from houseexpo.commands.train import train
from houseexpo.errors import ConfigError, HouseExpoError, MissingDependencyError
from houseexpo.pseudoslam import learning as needs
from tests.builders.needs import need
from tests.builders.training import write_split_huts, write_tiny

ROOT = Path(__file__).parents[3]


def said(*words: object) -> str:
    app = typer.Typer()
    app.command()(train)
    result = CliRunner().invoke(app, [*map(str, words)], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """The extra seems to be there: what is refused here is refused before it is used."""
    monkeypatch.setattr(needs, "find_spec", lambda _: object())


def test_without_the_extra_a_line_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(needs, "find_spec", lambda _: None)
    with pytest.raises(MissingDependencyError, match=r"houseexpo train needs PyTorch, .*: .*pip install -e '.\[learn"):
        said("avoidance", "--out", tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["--seed", "-1"], "seed: expected a whole number of at least 0"),
        (["--steps", "0"], "steps: expected a whole number of at least 1"),
        (["--config", "none.toml"], "none.toml: cannot be read"),
    ],
)
def test_what_cannot_be_is_refused_before_a_run_begins(
    installed: None, tmp_path: Path, words: list[str], problem: str
) -> None:
    with pytest.raises(ConfigError, match=problem):
        said("avoidance", "--out", tmp_path / "run", *words)
    assert not (tmp_path / "run").exists()


def test_lists_that_share_plans_are_refused(tmp_path: Path) -> None:
    need(modules=["torch", "stable_baselines3", "sb3_contrib", "tensorboard"], how="make learn")
    plans = write_split_huts(tmp_path, test=("hut_a",))
    with pytest.raises(ConfigError, match="share 1 of their plans"):
        said("exploration", "--out", tmp_path / "run", plans)


@pytest.mark.slow
def test_the_papers_experiments_run_on_a_small_scale(tmp_path: Path) -> None:
    """As ``make experiments`` does, with its own files; only with fewer steps and fewer tests."""
    need(modules=["torch", "stable_baselines3", "sb3_contrib", "tensorboard"], how="make learn")
    plans = write_split_huts(tmp_path)
    for name in ("avoidance", "exploration", "exploration-view-10m", "exploration-view-10m-cnn"):
        task = name.partition("-")[0]
        more = [plans] if task == "exploration" else []
        config = tmp_path / f"{name}.toml"
        config.write_text(re.sub("(?m)^plans = 200", "plans = 4", (ROOT / "experiments" / config.name).read_text()))
        words = [task, "--config", config, "--seed", 2, "--steps", 2048, "--threads", 1, *more, "--resume"]
        out = tmp_path / "runs" / name
        assert str(out / "policy.pt") in said(*words, "--out", out).replace("\n", "")
        about = json.loads((out / "policy.json").read_text())
        assert (about["task"], about["seed"]) == (task, 2)
        assert about["score"]["steps"] > 0
        assert (out / "policy.pt").stat().st_size < 5_000_000


@pytest.mark.parametrize("task", ["exploration", "chooser"])
@pytest.mark.parametrize("resumed", [[], ["--resume"]])
def test_ctrl_c_says_the_command_that_goes_on(
    installed: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, task: str, resumed: list[str]
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("houseexpo.dataset.open_dataset", interrupted)
    words = [task, str(tmp_path / "plans"), "--out", str(tmp_path / "run"), *resumed]
    monkeypatch.setattr(sys, "argv", ["houseexpo", "train", *words])
    app = typer.Typer()
    app.command()(train)
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 130
    goes_on = " ".join(words).removesuffix(" --resume")
    assert f"interrupted; it goes on by: houseexpo train {goes_on} --resume\n" in result.output


def test_make_experiments_names_commands_that_there_are(tmp_path: Path) -> None:
    need(programs=["make"], how="apt-get install make")
    shutil.copytree(ROOT / "experiments", tmp_path / "experiments", ignore=shutil.ignore_patterns("runs"))
    dry = ["make", "-n", "-f", str(ROOT / "Makefile"), "experiments", "SEEDS=7", f"RUNS={tmp_path}"]
    shown = subprocess.run(dry, cwd=ROOT, capture_output=True, text=True, check=True, env={**os.environ}).stdout
    [[names, train]] = re.findall(r"for name in (.+?); do.*?houseexpo (train .+? --resume)", shown, re.DOTALL)
    by_hand = {"chooser", "ten-minutes", "exploration-view-10m-42"}  # docs/pseudoslam/training.md runs these
    assert set(names.split()) == {file.stem for file in (ROOT / "experiments").glob("*.toml")} - by_hand
    assert train == "train ${name%%-*} --config experiments/$name.toml --seed $seed --resume"


def test_what_needs_no_onnx_says_so_and_without_the_extra_nothing_is_trained(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for task in ("chooser", "predictor"):
        with pytest.raises(ConfigError, match=f"train {task}: .* without PyTorch anyway; leave out --onnx"):
            said(task, "--onnx", "--out", tmp_path / "run")
    monkeypatch.setattr(needs, "find_spec", lambda name: None if name == "onnxruntime" else object())
    with pytest.raises(MissingDependencyError, match=r"houseexpo train --onnx needs ONNX Runtime, .*\[onnx\]"):
        said("avoidance", "--onnx", "--out", tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_a_training_is_exported_with_it_and_afterwards(tmp_path: Path) -> None:
    need(modules=["torch", "stable_baselines3", "sb3_contrib", "tensorboard", "onnx", "onnxruntime"], how="make learn")
    run = tmp_path / "run"
    words = ["avoidance", "--config", write_tiny(tmp_path, steps=64), "--threads", 1, "--onnx", "--out", run]
    assert f"{run / 'policy.onnx'}, to be played without PyTorch" in said(*words).replace("\n", "")
    exported = (run / "policy.onnx").read_bytes()
    for name, source in (("a", run), ("b", run / "policy.pt")):
        done = export_of(source, "--to", "onnx", "--out", tmp_path / name)
        assert done == f"{tmp_path / name / 'policy.onnx'}\n"
        assert (tmp_path / name / "policy.onnx").read_bytes() == exported
    for words, problem in (
        ([run, "--to", "onnx", "--out", run], "exists; name another folder, or add --replace"),
        ([run, "--to", "onnx", "--out", run, "--resolution", 0.1], "the other options are for plans; leave them out"),
        ([tmp_path, "--to", "onnx", "--out", run], "policy.pt: expected a policy, cannot be read: No such file"),
        ([run / "policy.onnx", "--to", "onnx", "--out", run], "expected a policy.pt, found what is exported already"),
    ):
        with pytest.raises(HouseExpoError, match=problem):
            export_of(*words)


def export_of(*words: object) -> str:
    app = typer.Typer()
    app.command()(export)
    result = CliRunner().invoke(app, [*map(str, words)], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output
