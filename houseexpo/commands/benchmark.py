"""``houseexpo benchmark``: run a policy, or teams of robots, in fixed plans, write the results, and compare them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from houseexpo.commands.arguments import PolicyName, Processes, ReplaceOption, make_completion
from houseexpo.errors import ConfigError

if TYPE_CHECKING:
    from houseexpo.dataset import Dataset
    from houseexpo.pseudoslam.worlds.maps import MapHouse

benchmark = typer.Typer(
    help="Measure policies on fixed tasks, plans and starts, and compare them.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)

Resolution = Annotated[
    float | None, typer.Option(help="Side of a cell of maps without a yaml, metres.", show_default="the track's")
]

TRACK_NAMES = (
    *("budget", "quality", "avoidance", "navigation", "pointgoal", "roomgoal", "objectgoal"),
    *("large", "noisy", "people", "social", "social-orca", "slam"),
    *("kth", "dare", "ariadne", "pipe-small", "pipe-medium", "pipe-large"),
)


@benchmark.command()
def run(
    policy: PolicyName,
    out: Annotated[Path, typer.Option(help="The result, a JSON file.", show_default=False)],
    track: Annotated[
        str,
        typer.Option(
            help="budget, quality, avoidance, navigation, pointgoal, roomgoal, objectgoal, large, noisy, people, "
            "social, social-orca, slam; on --maps also kth, dare, ariadne, pipe-small, pipe-medium or pipe-large.",
            autocompletion=make_completion(*TRACK_NAMES),
        ),
    ] = "budget",
    dataset: Annotated[
        Path | None,
        typer.Option(help="Data set with its list: a folder, an archive or JSON lines.", show_default="fetched"),
    ] = None,
    maps: Annotated[
        Path | None,
        typer.Option(help="Folder of maps instead of a data set; all of them are run.", show_default="none"),
    ] = None,
    resolution: Resolution = None,
    split: Annotated[str, typer.Option(help="The list from which plans are chosen.")] = "test",
    plans: Annotated[
        int | None,
        typer.Option(
            min=1, help="Number of plans; for avoidance, of episodes.", show_default="500, or all if there are fewer"
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the policy; starts are the same for all.")] = 0,
    workers: Processes = None,
    decision_limit: Annotated[float, typer.Option(min=0.001, help="Time limit of an action, seconds.")] = 60.0,
    prediction: Annotated[
        str | None,
        typer.Option(
            help="Score a predicted map by its IoU: policy (its method predicted_map), free, solid, lines, network, or "
            "network-tolerant.",
            show_default="none",
            autocompletion=make_completion("policy", "free", "solid", "lines", "network", "network-tolerant"),
        ),
    ] = None,
    replace: ReplaceOption = False,
) -> None:
    """Run a policy in fixed plans from fixed starts, and write the result.

    Except for times, the result does not depend on the number of processes.
    """
    from houseexpo.commands.arguments import open_data_set
    from houseexpo.commands.printing import make_console, print_name_and_text
    from houseexpo.outputs import CommandOutput
    from houseexpo.processes import count_cores
    from houseexpo.pseudoslam.benchmark.maps import read_maps
    from houseexpo.pseudoslam.benchmark.result import write_result
    from houseexpo.pseudoslam.benchmark.run import DEFAULT_PLANS, RunSettings, run_benchmark
    from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, find_track

    if out.suffix != ".json":
        raise ConfigError(f"--out: expected a file that ends in .json, found {out.name!r}")
    wanted = find_track(track)
    settings = RunSettings(
        split, plans or DEFAULT_PLANS, seed, workers or count_cores(), decision_limit, prediction or "", plans is None
    )
    with CommandOutput(out, [dataset, maps], replace=replace):  # check before hours of work
        houses: Dataset | list[MapHouse] | None = None
        if maps is not None:
            houses = read_maps(wanted, maps, resolution)
        elif wanted.needs_plans and wanted not in MAP_TRACKS:
            houses = open_data_set(dataset)
        result = run_benchmark(wanted, policy, houses, settings)
        write_result(result, out)
    _print([out])
    print_name_and_text(make_console(), "written", str(out))


@benchmark.command()
def verify(
    results: Annotated[list[Path], typer.Argument(help="Results of `houseexpo benchmark run`.", show_default=False)],
    dataset: Annotated[
        Path | None,
        typer.Option(help="Data set of the results: a folder, an archive or JSON lines.", show_default="fetched"),
    ] = None,
    maps: Annotated[
        Path | None, typer.Option(help="Folder of the maps of the results, instead of a data set.", show_default="none")
    ] = None,
    resolution: Resolution = None,
    workers: Processes = None,
) -> None:
    """Play the actions that results store again, and compare every value; mark the results whose values are right.

    The mark is a file RESULT.verified beside RESULT.json. `houseexpo benchmark compare` shows it.
    """
    from houseexpo.commands.arguments import open_data_set
    from houseexpo.commands.printing import make_console, print_name_and_text
    from houseexpo.processes import count_cores
    from houseexpo.pseudoslam.benchmark.maps import read_maps
    from houseexpo.pseudoslam.benchmark.result import read_result
    from houseexpo.pseudoslam.benchmark.tracks import MAP_TRACKS, find_track
    from houseexpo.pseudoslam.benchmark.verification import mark_verified, verify_result

    for file in results:
        result = read_result(file)
        track = find_track(result.track_id)
        houses: Dataset | list[MapHouse] | None = None
        if maps is not None:
            houses = read_maps(track, maps, resolution)
        elif track.needs_plans and track not in MAP_TRACKS and result.plans.split != "maps":
            houses = open_data_set(dataset)
        verify_result(result, houses, workers or count_cores(), str(file))
        mark = mark_verified(file, result)
        print_name_and_text(make_console(), "verified", f"{file}: all values are right; written {mark.name}")


@benchmark.command()
def compare(
    results: Annotated[list[Path], typer.Argument(help="Results, or folders of them.", show_default=False)],
    out: Annotated[
        Path | None,
        typer.Option(help="A page (.md) with the tables, and with curves in a folder beside it.", show_default=False),
    ] = None,
    title: Annotated[str, typer.Option(help="Heading of the page.")] = "Policies compared",
    curves: Annotated[
        bool, typer.Option("--curves", help="Also draw coverage over metres for each map, on tracks of maps.")
    ] = False,
    replace: ReplaceOption = False,
) -> None:
    """Compare results in a table for each track; they must be for the same plans."""
    from houseexpo.commands.printing import make_console, print_name_and_text
    from houseexpo.outputs import CommandOutput
    from houseexpo.pseudoslam.benchmark.comparison import read_results
    from houseexpo.pseudoslam.benchmark.page import check_file_name, write_comparison

    if out is not None:
        check_file_name(out)
    elif curves:
        raise ConfigError("--curves: expected a page to draw them on, found none; name one with --out")
    _print(results)
    if out is not None:
        with CommandOutput(out, (each for each in results if each.is_file()), replace=replace) as output:
            write_comparison(read_results(results), out, title, output.write, each_map=curves)
        print_name_and_text(make_console(), "written", str(out))


@benchmark.command()
def team(
    out: Annotated[Path, typer.Option(help="The tables, a file that ends in .md.", show_default=False)],
    track: Annotated[
        list[str] | None,
        typer.Option(
            help="team-2, team-4 or team-8; repeat it for several.",
            show_default="all",
            autocompletion=make_completion("team-2", "team-4", "team-8"),
        ),
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help="nearest, greedy, hungarian or auction; repeat it for several.",
            show_default="all",
            autocompletion=make_completion("nearest", "greedy", "hungarian", "auction"),
        ),
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(help="Data set with its list: a folder, an archive or JSON lines.", show_default="fetched"),
    ] = None,
    split: Annotated[str, typer.Option(help="The list from which plans are chosen.")] = "test",
    plans: Annotated[int, typer.Option(min=1, help="Number of plans.")] = 50,
    replace: ReplaceOption = False,
) -> None:
    """Let teams of robots explore fixed plans from fixed starts, and compare how they share out the work.

    Besides the tables, a file of the same name that ends in .json has the measures of each plan.
    """
    import json

    from houseexpo.commands.arguments import open_data_set
    from houseexpo.commands.printing import make_console, print_name_and_text, print_table
    from houseexpo.outputs import CommandOutput
    from houseexpo.pseudoslam.benchmark.cases import choose_plan_ids
    from houseexpo.pseudoslam.teams.policies import POLICIES as TEAM_POLICIES
    from houseexpo.pseudoslam.teams.policies import find_policy_class
    from houseexpo.pseudoslam.teams.tracks import TRACKS, find_team_track, format_track_markdown, make_table, run_team

    if out.suffix != ".md":
        raise ConfigError(f"--out: expected a file that ends in .md, found {out.name!r}")
    tracks = [find_team_track(name) for name in track or [one.name for one in TRACKS]]
    policies = policy or list(TEAM_POLICIES)
    for name in policies:
        find_policy_class(name)
    with CommandOutput(out, [dataset], replace=replace) as output:
        output.check(out.with_suffix(".json"))  # before hours of work
        houses = open_data_set(dataset)
        ids = choose_plan_ids(houses, split, plans)
        tables, results = [], []
        for one in tracks:
            found = [run_team(one, name, houses, ids) for name in policies]
            results += found
            tables.append(format_track_markdown(one, found))
            make_console().print(f"{one.id}: {len(found[0]['plans'])} plans", style="italic", highlight=False)
            print_table(make_console(), *make_table(found))
        output.write(out, "\n".join(tables).encode())
        output.write(out.with_suffix(".json"), json.dumps(results, indent=1).encode())
    print_name_and_text(make_console(), "written", f"{out} and {out.with_suffix('.json').name}")


def _print(files: list[Path]) -> None:
    from houseexpo.commands.printing import make_console, print_table
    from houseexpo.pseudoslam.benchmark.comparison import read_results
    from houseexpo.pseudoslam.benchmark.tables import describe_plans, table_heads, table_row

    for compared in read_results(files):
        make_console().print(
            f"{compared.track.id}: {describe_plans(compared)}", style="italic", highlight=False, soft_wrap=True
        )
        for metrics in compared.tables():
            print_table(
                make_console(),
                table_heads(metrics),
                [table_row(compared, entry, metrics) for entry in compared.rows(metrics)],
            )
