"""Define the command ``houseexpo fit``: fit the weights of models on labels of reviewed houses.

What is heavy is imported where the command runs.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from houseexpo.commands.arguments import Processes
from houseexpo.errors import ANSWER_IS_NO
from pipeline.cli_common import end_cleanly, load_build_config, resolve_manifest

if TYPE_CHECKING:
    from rich.table import Table

    from pipeline.fitting.labels import Marked
    from pipeline.fitting.models import OwnModels
    from pipeline.values import Input


def fit(
    labels: Annotated[
        list[Path], typer.Argument(help="Files that houseexpo labels wrote of reviewed houses.", show_default=False)
    ],
    out: Annotated[Path, typer.Option(help="File of weights to write, TOML.", show_default=False)],
    config: Annotated[
        Path | None,
        typer.Option(
            help="Manifest with which the houses were built, for the parameters of the stages.",
            show_default=False,
            callback=resolve_manifest,
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed by which houses are left out.")] = 0,
    workers: Processes = None,
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite a file that houseexpo did not write.")] = False,
) -> None:
    """Fit weights for houses of one kind on labels of reviewed houses.

    The weights say how sure a door, an entrance or a room is, and which entrances and spaces are left out. They are
    measured on houses left out of the fit, and only those that are better there are written; houseexpo build --weights
    uses them. The exit code is 1 if none is better.
    """
    from houseexpo.commands.printing import make_console
    from houseexpo.outputs import CommandOutput
    from houseexpo.processes import count_cores
    from houseexpo.words import count_noun
    from pipeline.fitting.labels import read_labels
    from pipeline.fitting.models import FOLDS, fit_own_models
    from pipeline.fitting.rows import rows_of_houses
    from pipeline.stages.logistic import source_of

    printed = make_console()
    with end_cleanly(), CommandOutput(out, labels, replace=replace) as output:
        marked: dict[Input, list[Marked]] = {}
        for file in labels:
            for item, storeys in read_labels(file).items():
                marked.setdefault(item, []).extend(storeys)
        rows, left_out = rows_of_houses(marked, load_build_config(config, {}), workers or count_cores())
        for sentence in left_out:
            printed.print(f"left out: {sentence}", style="yellow", highlight=False, soft_wrap=True)
        found = fit_own_models(rows, seed)
        printed.print(
            f"{count_noun(len(rows), 'labelled house')}; errors are of houses left out of the fit ({FOLDS} parts, seed "
            f"{seed})",
            highlight=False,
            soft_wrap=True,
        )
        printed.print(table_of(found))
        if found.models:
            better = ", ".join(_PLURALS[name] for name in found.models)
            heading = f"Written by houseexpo fit on {count_noun(len(rows), 'labelled house')}: better for {better}."
            output.write(out, source_of(found.models, heading).encode())
    if not found.models:
        typer.secho(
            f"no weights are better than those of houseexpo, so {out} was not written; review more houses of the kind, "
            "or build without --weights",
            fg=typer.colors.YELLOW,
            err=True,
        )
        raise typer.Exit(ANSWER_IS_NO)  # no weights are better than those of houseexpo, so no file is written
    printed.print(
        f"better for {better}; next: houseexpo build SOURCE --out OUT --weights {out}", highlight=False, soft_wrap=True
    )


_PLURALS = {"space": "spaces", "door": "doors", "entrance": "entrances", "room": "rooms"}


def table_of(found: OwnModels) -> Table:
    """Show how good the models of each sort of part are on houses left out of the fit."""
    from rich.table import Table

    table = Table(title="Mean squared error of the probabilities")
    for k, heading in enumerate(("of", "houses", "right", "wrong", "houseexpo's", "new", "chance", "better")):
        table.add_column(heading, justify="right" if 0 < k < 7 else "left")
    for each in found.comparisons:
        figures = [f"{value:.4f}" for value in (each.shipped, each.own, each.chance)]
        says = "too few houses" if each.is_untried else "yes" if each.is_better else "no"
        counts = [str(each.houses), str(each.right), str(each.wrong)]
        table.add_row(_PLURALS[each.part], *counts, *(["", "", ""] if each.is_untried else figures), says)
    return table
