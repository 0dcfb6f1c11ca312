"""``houseexpo observe``: write pairs of partial and complete maps, for learning map prediction."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from houseexpo.commands.arguments import FetchedDataSet, Processes, open_data_set


def observe(
    out: Annotated[Path, typer.Option(help="Folder to write.", show_default=False)],
    dataset: FetchedDataSet = None,
    limit: Annotated[
        int | None, typer.Option(min=1, help="Largest number of pairs.", show_default="a visit to each plan")
    ] = None,
    each: Annotated[int, typer.Option(min=1, help="Number of pairs from one visit to a plan.")] = 10,
    every: Annotated[int, typer.Option(min=1, help="Steps of the robot from one pair to the next.")] = 8,
    size: Annotated[float, typer.Option(help="Side of the window, metres.")] = 16.0,
    pixels: Annotated[int, typer.Option(min=2, help="Side of the window, pixels.")] = 128,
    rooms: Annotated[bool, typer.Option(help="Also write rooms and their labels.")] = True,
    noise: Annotated[bool, typer.Option(help="Add typical errors of laser and odometry.")] = False,
    config: Annotated[
        Path | None, typer.Option(help="YAML file of a SimulatorConfig.", show_default="the paper's")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of starts, paths and noise.")] = 0,
    workers: Processes = None,
) -> None:
    """Write pairs of maps, a robot's partial map and the whole house, as npz shards with a manifest.json.

    The same seed gives the same bytes with any number of workers. An interrupted run continues where it stopped.
    """
    from dataclasses import replace

    from houseexpo.commands.printing import make_console, print_problems
    from houseexpo.outputs import check_not_in_inputs
    from houseexpo.processes import count_cores
    from houseexpo.pseudoslam.config import SimulatorConfig
    from houseexpo.pseudoslam.io.pair_shards import write_pair_shards as run_observe
    from houseexpo.pseudoslam.io.pairs import USUAL_NOISE, PairConfig
    from houseexpo.words import count_noun

    check_not_in_inputs(out, [dataset])
    simulator = SimulatorConfig.from_yaml(config) if config else SimulatorConfig()
    if noise:
        simulator = replace(simulator, noise=USUAL_NOISE)
    given = PairConfig(each, every, size, pixels, rooms, simulator)
    done = run_observe(open_data_set(dataset), out, given, limit=limit, seed=seed, workers=workers or count_cores())
    print_to = make_console()
    print_to.print(
        f"{count_noun(done.pairs, 'pair')} in {out}: {count_noun(done.made, 'shard')} made, {done.known} known, "
        f"{done.size / 1e6:,.1f} MB",
        highlight=False,
        soft_wrap=True,
    )
    print_problems(print_to, "no pairs", done.refused)
