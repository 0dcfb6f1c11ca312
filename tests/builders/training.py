"""Tiny runs of ``houseexpo train``: a folder of huts with lists, and configurations that learn some hundred steps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from houseexpo.configuration import config_from_mapping
from houseexpo.dataset import open_dataset
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.learning.config import TrainConfig
from houseexpo.pseudoslam.learning.environments import choose_plans
from tests.builders.simulations import hut

TRAIN, TEST = ("hut_a", "hut_b", "hut_c"), ("hut_d", "hut_e")
SIDES_M = dict(zip((*TRAIN, *TEST), (3.0, 4.5, 6.0, 3.5, 5.0), strict=True))
TINY: dict[str, Any] = {
    "steps": 384,
    "envs": 2,
    "memory": 8,
    "checkpoint_every": 128,
    "ppo": {"rollout_steps": 32, "minibatch": 32, "epochs": 1, "learning_rate": 3e-3},
    "environment": {"simulator": {"pixels_per_metre": 10.0, "max_steps": 20}},
    "evaluation": {"every": 128, "plans": 3},
}


def tiny(**changes: Any) -> TrainConfig:
    """Return a configuration that learns 384 steps: six updates, three checkpoints, three tests."""
    return replace(config_from_mapping(TrainConfig, TINY), **changes)


def write_split_huts(folder: Path, test: tuple[str, ...] = TEST) -> Path:
    """Write a data set of five huts and its lists; return its folder."""
    plans = folder / "huts"
    (plans / "splits").mkdir(parents=True)
    for name, side_m in SIDES_M.items():
        (plans / f"{name}.json").write_bytes(encode(hut(name, side_m)))
    for name, ids in (("train", TRAIN), ("test", test)):
        (plans / "splits" / f"{name}.txt").write_text("".join(f"{one}\n" for one in ids))
    return plans


def write_tiny(folder: Path, **more: Any) -> Path:
    """Write the tiny configuration as TOML; ``more`` are values of its first level."""
    lines = [f"{key} = {value!r}" for key, value in {**TINY, **more}.items() if not isinstance(value, dict)]
    lines += ["[ppo]", *(f"{key} = {value!r}" for key, value in TINY["ppo"].items())]
    lines += ["[environment.simulator]", "pixels_per_metre = 10.0", "max_steps = 20"]
    lines += ["[evaluation]", "every = 128", "plans = 3"]
    file = folder / "tiny.toml"
    file.write_text("\n".join(lines))
    return file


def run(folder: Path, config: TrainConfig | None = None, task: str = "avoidance", **given: Any) -> dict[str, float]:
    """Learn in the paper's room, or in huts that lie beside the folder, with one thread: tests share the machine."""
    from houseexpo.pseudoslam.learning.training import TrainingRun, train

    config = config or tiny()
    plans = None
    if task != "avoidance":
        huts = folder.parent / "huts"
        plans = open_dataset(huts if huts.is_dir() else write_split_huts(folder.parent))
    chosen = choose_plans(plans, config.environment, config.evaluation.plans)
    return train(TrainingRun(task, config, chosen, folder), threads=1, **given)
