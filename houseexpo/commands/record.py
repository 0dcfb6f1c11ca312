"""``houseexpo record``: let a policy drive a robot in a house, and write it as a GIF, a movie or a ROS bag."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Final, Literal

import typer

from houseexpo.commands.arguments import (
    POLICIES,
    HousesArgument,
    MapResolution,
    MotionOption,
    ReplaceOption,
    TaskName,
    TaskOption,
    make_completion,
)

_POLICIES: Final[dict[TaskName, str]] = {"exploration": "frontier", "avoidance": "wall", "navigation": "a-star"}


def record(
    dataset: HousesArgument = None,
    out: Annotated[Path | None, typer.Option(help="Movie to write: .gif or .mp4.", show_default="none")] = None,
    bag: Annotated[
        Path | None, typer.Option(help="ROS 2 bag to write: .mcap (needs the extra 'bag').", show_default="none")
    ] = None,
    plan: Annotated[str | None, typer.Option(help="Id of the plan.", show_default="at random")] = None,
    resolution: MapResolution = None,
    task: TaskOption = "exploration",
    policy: Annotated[
        str | None,
        typer.Option(
            help="A name such as frontier, a file, or module:name; several, separated by commas, run side by side.",
            show_default="frontier; wall, avoidance; a-star, navigation",
            autocompletion=make_completion(*POLICIES),
        ),
    ] = None,
    steps: Annotated[int, typer.Option(min=1, help="Largest number of steps; the episode may end earlier.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Seed of plan, start, noise and policy.")] = 0,
    fps: Annotated[float, typer.Option(help="Pictures per second.")] = 15.0,
    every: Annotated[int, typer.Option(min=1, help="Number of steps between pictures.")] = 1,
    shows: Annotated[
        Literal["map", "both", "truth", "beside"],
        typer.Option(
            help="map: what the robot knows; both: that over a pale house; truth: the house; beside: house and map."
        ),
    ] = "both",
    size: Annotated[tuple[int, int], typer.Option(help="Largest width and height, pixels.")] = (640, 480),
    config: Annotated[
        Path | None, typer.Option(help="YAML file of a SimulatorConfig.", show_default="the task's")
    ] = None,
    motion: MotionOption = None,
    replace: ReplaceOption = False,
) -> None:
    """Write a movie of a policy at work, or a ROS bag with its robot's map and sensor data."""
    from houseexpo.commands.arguments import make_environment
    from houseexpo.commands.printing import make_console
    from houseexpo.errors import ConfigError
    from houseexpo.outputs import CommandOutput
    from houseexpo.pseudoslam.agents.policies import load_interface, make_policy
    from houseexpo.pseudoslam.io.record import Racer, record_race
    from houseexpo.pseudoslam.io.record import record_episode as write
    from houseexpo.words import count_noun

    printed = make_console()
    names = (_POLICIES[task] if policy is None else policy).split(",")
    if len(names) > 1:
        if out is None or bag is not None or shows == "beside":
            raise ConfigError("--policy: several make a movie, --out FILE; no bag, and no --shows beside")
        with CommandOutput(out, [dataset], replace=replace), printed.status(f"recording {count_noun(steps, 'step')}"):
            interfaces = [load_interface(name, task) for name in names]
            racers = [
                (
                    name,
                    *make_environment(
                        dataset, plan, task, config, steps, interface=interface, resolution=resolution, motion=motion
                    ),
                )
                for name, interface in zip(names, interfaces, strict=True)
            ]
            runners = [Racer(name, env, make_policy(name, env, seed)) for name, env, _ in racers]
            record_race(
                runners, out, steps, seed=seed, options=racers[0][2], fps=fps, every=every, shows=shows, most_px=size
            )
        for racer in runners:
            printed.print(f"{racer.name}: {racer.caption()}", highlight=False, soft_wrap=True)
        return
    with ExitStack() as opened:
        for file in (out, bag):
            if file is not None:
                opened.enter_context(CommandOutput(file, [dataset], replace=replace))
        opened.enter_context(printed.status(f"recording {count_noun(steps, 'step')}"))
        interface = load_interface(names[0], task)
        env, options = make_environment(
            dataset, plan, task, config, steps, interface=interface, ranges=bag is not None, resolution=resolution,
            motion=motion,
        )  # fmt: skip
        acts = make_policy(names[0], env, seed)
        done = write(
            env, acts, out, steps, seed=seed, options=options, fps=fps, every=every, shows=shows, most_px=size, bag=bag
        )
    written = " and ".join(str(file) for file in (out, bag) if file)
    printed.print(
        f"{written}: {count_noun(done.steps, 'step')} in plan {done.info['plan_id']}, "
        f"{done.info['coverage']:.0%} seen, "
        f"{count_noun(done.info['collisions'], 'collision')}, reward {done.reward:.2f}",
        highlight=False,
        soft_wrap=True,
    )
