"""``houseexpo prepare``: compute and cache what the simulator needs for every plan, so that resets are fast."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from houseexpo.commands.arguments import FetchedDataSet, Processes, open_data_set


def prepare(
    dataset: FetchedDataSet = None,
    pixels_per_metre: Annotated[
        float,
        typer.Option("--pixels-per-metre", "--resolution", min=1.0, help="Cells of the grid, per metre."),
    ] = 25.0,
    robot_radius: Annotated[float, typer.Option(help="Radius of the robot, metres.")] = 0.2,
    laser_range: Annotated[float, typer.Option(help="Range of the laser, metres.")] = 5.0,
    config: Annotated[
        Path | None, typer.Option(help="YAML file of a SimulatorConfig, instead of the options above.")
    ] = None,
    workers: Processes = None,
) -> None:
    """Compute and cache what PseudoSLAM needs for every plan, so that resets to a new house are fast.

    Environments with the same resolution, robot radius and laser range use the cache automatically. Without it, they
    compute and cache what they need during the resets.
    """
    from houseexpo.commands.printing import make_console, print_problems
    from houseexpo.processes import count_cores
    from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
    from houseexpo.pseudoslam.worlds.cache import prepare_worlds as run_prepare
    from houseexpo.words import count_noun

    given = (
        SimulatorConfig.from_yaml(config)
        if config
        else SimulatorConfig(pixels_per_metre, RobotConfig(radius_m=robot_radius), LaserConfig(range_m=laser_range))
    )
    done = run_prepare(open_data_set(dataset), given, workers or count_cores())
    out = make_console()
    out.print(
        f"{count_noun(done.made, 'world')} made, {done.known} known, {done.size / 1e6:,.1f} MB in {done.file}",
        highlight=False,
        soft_wrap=True,
    )
    print_problems(out, "no world", done.refused)
