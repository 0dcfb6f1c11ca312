"""``houseexpo play``: drive a simulated robot through a house with the arrow keys, and watch its map grow."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from houseexpo.commands.arguments import HousesArgument, MapResolution, MotionOption, ReplaceOption, TaskOption

_NO_END = 1_000_000_000


def play(
    dataset: HousesArgument = None,
    plan: Annotated[str | None, typer.Option(help="Id of the plan.", show_default="at random")] = None,
    resolution: MapResolution = None,
    task: TaskOption = "exploration",
    motion: MotionOption = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the trajectory and the map.", show_default="nothing is kept")
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="YAML file of a SimulatorConfig.", show_default="the task's, without an end")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of plan, start and noise.", show_default="at random")] = None,
    replace: ReplaceOption = False,
) -> None:
    """Drive a robot through a house with the arrow keys, and watch its map grow."""
    from houseexpo.commands.arguments import make_environment
    from houseexpo.commands.printing import make_console
    from houseexpo.files import make_folder
    from houseexpo.outputs import CommandOutput
    from houseexpo.pseudoslam.agents.driving import FILES, DriveSession, drive_by_keys
    from houseexpo.pseudoslam.render.terminal import Terminal

    output = None if out is None else CommandOutput(out, [dataset], replace=replace, folder=True)
    if out is not None and output is not None:  # check now, not when the drive is over
        make_folder(out)
        with output:
            for name in FILES:
                output.check(out / name)
    screen = Terminal()  # first, since nothing else makes sense without one
    printed = make_console()
    with printed.status("making the house ready"):
        env, options = make_environment(dataset, plan, task, config, _NO_END, resolution=resolution, motion=motion)
        session = DriveSession(env, seed, options)
    with screen:
        drive_by_keys(session, screen)
    printed.print(session.caption.split("\n")[0], highlight=False)
    if out is not None and output is not None:
        with output:
            for file in session.save(out, output.write):
                printed.print(file, highlight=False, soft_wrap=True)
