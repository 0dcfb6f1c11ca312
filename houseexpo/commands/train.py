"""``houseexpo train``: train a policy to explore, choose frontiers, avoid obstacles or go to goals, and evaluate it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from houseexpo.commands.arguments import MotionName, TaskName
from houseexpo.errors import INTERRUPTED, ConfigError


def train(
    task: Annotated[
        Literal["exploration", "chooser", "predictor", "avoidance", "navigation"],
        typer.Argument(
            help="What to learn; chooser: choosing frontiers; predictor: what a map does not show yet.",
            show_default=False,
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder of the run.", show_default=False)],
    dataset: Annotated[
        Path | None, typer.Argument(help="Data set.", show_default="the file's, else fetched; avoidance: a room")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            help="TOML file of a TrainConfig, a ChoosingConfig or a PredictorConfig.", show_default="PPO's usual"
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue from the folder's last complete checkpoint.")
    ] = False,
    seed: Annotated[int | None, typer.Option(help="Seed of all random numbers.", show_default="the file's")] = None,
    steps: Annotated[
        int | None,
        typer.Option(help="Number of steps of training, rounded up to whole updates.", show_default="the file's"),
    ] = None,
    threads: Annotated[
        int | None,
        typer.Option(min=1, help="Number of threads.", show_default="one per core; PyTorch one"),
    ] = None,
    motion: Annotated[
        MotionName | None,
        typer.Option(
            help="How the robot moves; with a drive, actions are continuous.", show_default="the file's, else discrete"
        ),
    ] = None,
    onnx: Annotated[
        bool, typer.Option("--onnx", help="Also write policy.onnx, which is played without PyTorch.")
    ] = False,
) -> None:
    """Train a policy by PPO on the robot's map, with or without a memory, and evaluate it on other plans.

    A killed run continues with --resume, with the same result as without the interruption. The folder contains
    policy.pt and policy.json, the curves learning.csv and evaluation.csv, and logs for TensorBoard. A chooser is
    trained by a search over whole explorations, without PyTorch; its folder contains weights.json. A predictor learns
    from maps of explored plans and of made office floors; its folder contains predictor.npz.
    """
    from houseexpo.commands.printing import current_command_line

    if task == "predictor" and (motion is not None or threads not in {None, 1}):
        raise ConfigError(
            "train predictor: it has no robot to move and uses one thread; leave out --motion and --threads"
        )
    if task in {"chooser", "predictor"} and onnx:
        raise ConfigError(f"train {task}: what it writes is used without PyTorch anyway; leave out --onnx")
    if task == "chooser" and steps is not None:
        raise ConfigError("train chooser: --steps is not for it; its file says how many generations and plans")
    if task == "chooser" and motion not in {None, "discrete"}:
        raise ConfigError(f"train chooser: frontiers are reached by discrete motions, found --motion {motion}")
    try:
        if task == "chooser":
            _chooser(out, config, dataset, seed, resume=resume, threads=threads)
        elif task == "predictor":
            _predictor(out, config, dataset, seed, steps, resume=resume)
        else:
            _policy(task, out, config, dataset, seed, steps, threads, motion, resume=resume, onnx=onnx)
    except KeyboardInterrupt:  # the same command would be refused, since the folder now holds a run
        again = current_command_line() + ("" if resume else " --resume")
        typer.echo(f"interrupted; it goes on by: {again}", err=True)
        raise typer.Exit(INTERRUPTED) from None


def _policy(
    task: TaskName,
    out: Path,
    config: Path | None,
    dataset: Path | None,
    seed: int | None,
    steps: int | None,
    threads: int | None,
    motion: MotionName | None,
    *,
    resume: bool,
    onnx: bool,
) -> None:
    """Train a policy by PPO, and export it if wanted."""
    from dataclasses import replace
    from functools import partial

    from houseexpo.commands.arguments import open_data_set
    from houseexpo.commands.printing import make_console
    from houseexpo.configuration import read_config
    from houseexpo.outputs import check_not_in_inputs
    from houseexpo.pseudoslam.learning import need_extra
    from houseexpo.pseudoslam.learning.config import TrainConfig
    from houseexpo.pseudoslam.learning.environments import check_task_options, choose_plans

    need_extra("learn", "houseexpo train")
    if onnx:
        need_extra("onnx", "houseexpo train --onnx")
    changes = {"seed": seed, "steps": steps}
    given = read_config(TrainConfig, config) if config else TrainConfig()
    given = replace(given, **{name: value for name, value in changes.items() if value is not None})  # type: ignore[arg-type]
    if motion is not None:
        driven = {} if motion == "discrete" else {"actions": "continuous"}
        given = replace(given, environment=replace(given.environment, motion=motion, **driven))  # type: ignore[arg-type]
    try:
        check_task_options(task, given.environment)
    except ConfigError as error:
        raise ConfigError(f"{config}: {error}" if config else str(error)) from None
    where = dataset or (Path(given.environment.dataset) if given.environment.dataset else None)
    check_not_in_inputs(out, [where])
    opened = None if where is None and task == "avoidance" else open_data_set(where)
    given = replace(given, environment=replace(given.environment, dataset=str(where) if where else None))

    from houseexpo.pseudoslam.learning.training import POLICY, TrainingRun, train as run_train  # isort: skip  # PyTorch

    say = partial(make_console().print, highlight=False, soft_wrap=True)
    plans = choose_plans(opened, given.environment, given.evaluation.plans)
    run_train(TrainingRun(task, given, plans, out), resume=resume, threads=threads, say=say)
    say(f"{out / POLICY}, described in {out / Path(POLICY).with_suffix('.json')}")
    if onnx:
        from houseexpo.pseudoslam.learning.onnx_export import export_policy

        say(f"{export_policy(out / POLICY, out, replace=resume)}, to be played without PyTorch")


def _chooser(
    out: Path, config: Path | None, dataset: Path | None, seed: int | None, *, resume: bool, threads: int | None
) -> None:
    """Train a chooser of frontiers."""
    from dataclasses import replace
    from functools import partial

    from houseexpo.commands.arguments import open_data_set
    from houseexpo.commands.printing import make_console
    from houseexpo.configuration import read_config
    from houseexpo.outputs import check_not_in_inputs
    from houseexpo.processes import count_cores
    from houseexpo.pseudoslam.learning.chooser_training import WEIGHTS, ChooserConfig, train_chooser

    given = read_config(ChooserConfig, config) if config else ChooserConfig()
    given = given if seed is None else replace(given, seed=seed)
    check_not_in_inputs(out, [dataset])
    opened, say = open_data_set(dataset), partial(make_console().print, highlight=False, soft_wrap=True)
    threads = threads or count_cores()
    train_chooser(opened, opened.split("train").ids, given, out, resume=resume, threads=threads, say=say)
    say(f"{out / WEIGHTS}")


def _predictor(
    out: Path, config: Path | None, dataset: Path | None, seed: int | None, steps: int | None, *, resume: bool
) -> None:
    """Train a predictor of maps."""
    from dataclasses import replace
    from functools import partial

    from houseexpo.commands.arguments import open_data_set
    from houseexpo.commands.printing import make_console
    from houseexpo.configuration import read_config
    from houseexpo.inference.map_prediction import WEIGHTS
    from houseexpo.outputs import check_not_in_inputs
    from houseexpo.pseudoslam.predictor.training import PredictorConfig, train_predictor

    given = read_config(PredictorConfig, config) if config else PredictorConfig()
    given = replace(given, **{key: value for key, value in (("seed", seed), ("steps", steps)) if value is not None})
    check_not_in_inputs(out, [dataset])
    opened, say = open_data_set(dataset), partial(make_console().print, highlight=False, soft_wrap=True)
    train_predictor(opened, opened.split("train").ids, given, out, resume=resume, say=say)
    say(f"{out / WEIGHTS}")
