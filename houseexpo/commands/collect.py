"""``houseexpo collect``: write episodes of a policy as a Minari data set, for learning offline."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from houseexpo.commands.arguments import FetchedDataSet, PolicyName, Processes, make_completion, open_data_set
from houseexpo.commands.benchmark import TRACK_NAMES


def collect(
    policy: PolicyName,
    out: Annotated[Path, typer.Option(help="Folder to write, named as Minari does: NAME-v0.", show_default=False)],
    dataset: FetchedDataSet = None,
    track: Annotated[
        str,
        typer.Option(
            help="Task, sensor and horizon, as in `houseexpo benchmark run`; not on maps.",
            autocompletion=make_completion(*TRACK_NAMES),
        ),
    ] = "budget",
    episodes: Annotated[int, typer.Option(min=1, help="Number of episodes.")] = 100,
    split: Annotated[
        str | None,
        typer.Option(help="The list from which plans are taken, each once before any again.", show_default="all plans"),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of plans, starts, noise and policy.")] = 0,
    workers: Processes = None,
    decision_limit: Annotated[float, typer.Option(min=0.001, help="Time limit of an action, seconds.")] = 60.0,
) -> None:
    """Write episodes of a policy as a Minari data set, to learn from without a simulator (needs the extra 'minari').

    The same seed gives the same data with any number of workers.
    """
    from houseexpo.commands.printing import make_console
    from houseexpo.outputs import check_not_in_inputs
    from houseexpo.processes import count_cores
    from houseexpo.pseudoslam.benchmark.collection import CollectSettings, collect_episodes
    from houseexpo.pseudoslam.benchmark.tracks import find_track
    from houseexpo.words import count_noun

    wanted = find_track(track)
    check_not_in_inputs(out, [dataset])
    settings = CollectSettings(episodes, split or "", seed, workers or count_cores(), decision_limit)
    houses = open_data_set(dataset) if wanted.needs_plans else None
    done = collect_episodes(wanted, policy, houses, out, settings)
    left_out = f"; {count_noun(done.left_out, 'plan')} passed over: no room for the robot, or no goal"
    make_console().print(
        f"{out}: {count_noun(done.episodes, 'episode')}, {count_noun(done.steps, 'step')}, mean reward "
        f"{done.reward:.2f}, success {done.success:.0%}; MINARI_DATASETS_PATH={out.resolve().parent} lets "
        f"minari.load_dataset({out.name!r}) find it" + (left_out if done.left_out else ""),
        highlight=False,
        soft_wrap=True,
    )
