"""Define ``houseexpo validate``: check every plan of a data set, and the files of a folder against its manifest."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from houseexpo.commands.arguments import DataSetArgument, Processes
from houseexpo.errors import ANSWER_IS_NO


def validate(
    dataset: DataSetArgument,
    json: Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")] = False,
    list_: Annotated[bool, typer.Option("--list", help="Print one line for each finding.")] = False,
    workers: Processes = None,
) -> None:
    """Check every plan of a data set, and a folder against its manifest.

    The exit code is 0 if nothing is found, 1 if something is, and 2 if the data set cannot be read.
    """
    from houseexpo.commands.printing import make_console, new_table, print_json
    from houseexpo.dataset.validation import RULES
    from houseexpo.dataset.validation import validate_dataset as run_validate
    from houseexpo.processes import count_cores
    from houseexpo.words import count_noun

    report = run_validate(dataset, workers or count_cores())
    if json:
        rules = {rule: {"findings": found, "plans": plans} for rule, (found, plans) in report.by_rule().items()}
        print_json({"plans": report.plans, "rules": rules, "findings": list(map(asdict, report.findings))})
        raise typer.Exit(1 if report.findings else 0)
    out = make_console()
    if list_:
        for finding in report.findings:
            out.print(str(finding), highlight=False, soft_wrap=True)
    table = new_table(
        f"{dataset.name}: {count_noun(report.plans, 'plan')}, {count_noun(len(report.findings), 'finding')}"
    )
    table.add_column("rule")
    table.add_column("findings", justify="right")
    table.add_column("plans", justify="right")
    table.add_column("what it asks")
    for rule, (found, plans) in report.by_rule().items():
        table.add_row(rule, str(found), str(plans), RULES[rule], style="red" if found else "")
    out.print(table)
    if report.findings:
        raise typer.Exit(ANSWER_IS_NO)
