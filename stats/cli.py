"""Define the command ``houseexpo stats``: measure a data set, print tables or JSON, write a report, list bad plans."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from houseexpo.errors import ConfigError
from houseexpo.tolerances import ROBOT_M
from houseexpo.words import count_noun

if TYPE_CHECKING:
    from stats.measure import MeasuredDataSet

_NAMED = 8
"""The number of unreadable plans that the terminal lists; ``--json`` lists all."""


def stats(
    dataset: Annotated[Path, typer.Argument(help="A data set: a folder, .tar.gz, .zip, .jsonl or .jsonl.gz.")],
    out: Annotated[
        list[Path] | None,
        typer.Option(help="The report as .html, the numbers as .json; may be repeated.", show_default=False),
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON, for other programs.")] = False,
    list_bad: Annotated[
        bool, typer.Option("--list-bad", help="List plans that a robot cannot cross, invalid rings and repeats.")
    ] = False,
    audit: Annotated[
        bool, typer.Option("--audit", help="List plans that break a rule of real homes, with the reasons.")
    ] = False,
    radius: Annotated[
        float | None,
        typer.Option(
            min=0.01, max=5, help="Radius of the robot, for --list-bad.", metavar="METRES", show_default=f"{ROBOT_M:g}"
        ),
    ] = None,
    compare: Annotated[Path | None, typer.Option(help="Another data set for comparison.", show_default=False)] = None,
    geometry: Annotated[
        bool, typer.Option("--geometry", help="Find rooms and doors of plans without them; takes some minutes, once.")
    ] = False,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Number of processes.", show_default="one per core")
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Overwrite files that houseexpo did not write.")] = False,
) -> None:
    """Show statistics of a data set: rooms, labels, areas, doors, navigability, repeated plans, splits.

    Plans with rooms are checked against rules of real homes and shown beside nine public data sets. Measurements are
    cached, so that a second run is fast. Plans that cannot be read are listed and left out.
    """
    from houseexpo.commands.printing import make_console, print_json, print_name_and_text
    from houseexpo.outputs import CommandOutput
    from stats.html_report import check_report_paths, write_statistics
    from stats.measure import open_and_measure
    from stats.report import Report
    from stats.terminal_tables import report_tables

    files = out or []
    check_report_paths(files)
    if radius is not None and not list_bad:
        raise ConfigError("--radius: the report is for fixed radii, another one is for --list-bad; add that")
    if list_bad or audit:
        _check_alone({"--list-bad": list_bad, "--audit": audit, "--out": out, "--compare": compare})
    with ExitStack() as opened:
        for path in files:
            opened.enter_context(CommandOutput(path, [dataset, compare], replace=replace))
        one = open_and_measure(dataset, geometry=geometry, workers=workers)
        _say_broken(one)
        if list_bad:
            _list_bad(one, radius or ROBOT_M, workers, json=json)
            return
        if audit:
            _list_audited(one, json=json)
            return
        other = None if compare is None else open_and_measure(compare, geometry=geometry, workers=workers)
        report = Report(one.total(), None if other is None else other.total(), one.broken)
        if json:
            print_json(report.values())
        for table in () if json else report_tables(report):
            make_console().print(table)
        for path in files:
            write_statistics(report, path)
            print_name_and_text(make_console(stderr=json), "written", str(path))


def _check_alone(given: Mapping[str, object]) -> None:
    """Refuse a list of plans beside what only the report has, or beside another list."""
    names = [name for name, value in given.items() if value]
    if len(names) > 1:
        raise ConfigError(f"{names[0]}: prints a list and no report; leave out {' and '.join(names[1:])}")


def _list_bad(one: MeasuredDataSet, radius_m: float, workers: int | None, *, json: bool) -> None:
    """Print the plans that need a review, as lines that start with the id or as JSON."""
    from houseexpo.commands.printing import print_json
    from stats.bad_plans import find_bad_plans

    found = find_bad_plans(one.data_set, one.records, radius_m, workers)
    if json:
        broken = [str(each) for each in one.broken]
        print_json({"radius_m": radius_m, "bad": [plan.values() for plan in found], "broken": broken})
        return
    for plan in found:
        sys.stdout.write(f"{plan.id}\t{'; '.join(plan.reasons(radius_m))}\n")


def _list_audited(one: MeasuredDataSet, *, json: bool) -> None:
    """Print the plans that break a rule of real homes, as lines that start with the id or as JSON."""
    from houseexpo.commands.printing import print_json

    audits = [(found.id, found.audit) for found in one.records if found.audit is not None]
    if not audits:
        raise ConfigError("--audit: expected plans with rooms, found none; --geometry finds them in the outlines")
    found = {name: reasons for name, audit in audits if (reasons := list(audit.reasons()))}
    if json:
        print_json({"audited": len(audits), "break_a_rule": found, "broken": [str(each) for each in one.broken]})
        return
    for name, reasons in found.items():
        sys.stdout.write(f"{name}\t{'; '.join(reasons)}\n")


def _say_broken(one: MeasuredDataSet) -> None:
    """List the plans that cannot be read, on standard error."""
    if not one.broken:
        return
    at = count_noun(len(one.broken), "place")
    typer.secho(f"plans left out, cannot be read, at {at}", fg=typer.colors.RED, err=True)
    for broken in one.broken[:_NAMED]:
        typer.echo(f"  {broken}", err=True)
    if len(one.broken) > _NAMED:
        typer.echo(f"  and {len(one.broken) - _NAMED} more; --json names all", err=True)
