"""What came of a build, for people, in the terminal: tables and lines; ``pipeline.report_page`` writes the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

from houseexpo.plan import explanations
from houseexpo.plan.quality import SURE
from houseexpo.words import counted
from pipeline.batch.assemble import DataSet
from pipeline.batch.entry import Entry, Refused
from pipeline.sources.other_programs import how_to_export


def outcome_table(stats: Mapping[str, Any]) -> Table:
    """Show what became of the inputs, rejections by reason."""
    outcomes = stats["outcomes"]
    table = Table(title="Outcomes", title_justify="left", show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_row("inputs", str(outcomes["inputs"]), end_section=True)
    table.add_row(Text("plans", "green"), str(outcomes["plans"]))
    if outcomes["doubtful"]:
        table.add_row(f"  doubtful: quality below {SURE:g}", str(outcomes["doubtful"]), style="yellow")
    table.add_row(Text("duplicates", "yellow"), str(outcomes["duplicates"]))
    table.add_row(Text("rejected", "red"), str(outcomes["rejected"]))
    for reason, count in outcomes["reasons"].items():
        table.add_row(f"  {reason}", str(count), style="dim")
    if outcomes["rules"]:
        table.add_section()
        table.add_row("plans in which a rule", "")
        for rule, count in outcomes["rules"].items():
            table.add_row(f"  {explanations.NOTES.get(rule, rule)}", str(count), style="dim")
    return table


def plans_line(stats: Mapping[str, Any]) -> str | None:
    """Say in a line what the plans are like; None where there are none, or nothing is installed that summarises them.

    ``houseexpo stats`` says more.
    """
    plans = stats.get("plans")
    if not plans or not plans["rooms"]["count"]:
        return None
    named = {"Rooms a house": ("rooms", ""), "free area": ("area_m2", " m2"), "doors a house": ("doors", "")}
    found = [f"{name} {plans[key]['mean']:.1f}{unit}" for name, (key, unit) in named.items() if plans[key]["count"]]
    return f"{', '.join(found)} (means)"


def reasons_lines(data_set: DataSet, out: str, most: int = 8) -> list[str]:
    """Say why each input was rejected where they are few; where they are many, where in ``out`` that is written."""
    if len(data_set.refused) > most:
        return [f"why each of the {len(data_set.refused)} was rejected: {out}/rejected.jsonl"]
    return [
        f"{refused.id}{f' ({file})' if file not in {'', refused.id} else ''}: {refused.detail}"
        + (f" ({refused.advice})" if refused.advice else "")
        for file, refused in refused_of(data_set)
    ]


def refused_of(data_set: DataSet) -> list[tuple[str, Refused]]:
    """Return what was rejected, by id, each with its input's file."""
    found = [(entry.file, refused) for entry in data_set.entries for refused in entry.refused]
    return sorted(found, key=lambda pair: pair[1])


def notes_lines(data_set: DataSet) -> list[str]:
    """Say what a person may wonder about: files that were ignored, inputs that gave several outcomes."""
    lines = []
    if data_set.ignored:
        counts = sorted(data_set.ignored.items(), key=lambda pair: (-pair[1], pair[0]))
        kinds = ", ".join(f"{count} {suffix}" for suffix, count in counts[:8]) + (", ..." if len(counts) > 8 else "")
        lines.append(f"ignored, no houses by themselves: {kinds}{how_to_export(data_set.ignored)}")
    several = [entry for entry in data_set.entries if len(list(entry.outcomes)) > 1]
    if several:
        outcomes = sum(len(list(entry.outcomes)) for entry in data_set.entries)
        inputs = counted(len(data_set.entries), "input")
        lines.append(f"{inputs} gave {outcomes} outcomes: {len(several)} with several levels or buildings")
    if len(data_set.licences) > 1:
        named = ", ".join(name or "none" for name in data_set.licences)
        lines.append(f"no licence holds for the whole data set: its sources state {named}")
    return lines


def longest(data_set: DataSet, most: int = 10) -> list[tuple[str, str, float]]:
    """Return the inputs that took longest: the id of the first outcome, the file, and the seconds."""
    found = sorted((-entry.seconds, entry.file, _id(entry)) for entry in data_set.entries if entry.seconds)
    return [(name, file, -seconds) for seconds, file, name in found[:most]]


def _id(entry: Entry) -> str:
    """Return the id that people meet in the data set: that of the input's first outcome."""
    return next((outcome.id for outcome in entry.outcomes), "")


def longest_table(data_set: DataSet) -> Table:
    """Show the inputs that took longest."""
    table = Table(title="Longest", title_justify="left", show_header=False)
    table.add_column(overflow="fold")
    table.add_column(overflow="fold", style="dim")
    table.add_column(justify="right")
    for name, file, seconds in longest(data_set):
        table.add_row(Text(name), Text(file if file != name else ""), f"{seconds:.2f} s")
    return table


def stage_seconds(data_set: DataSet) -> dict[str, float]:
    """Return the seconds of all inputs by stage, in the order of the stages; reading a house is ``source``."""
    total: dict[str, float] = {}
    for entry in data_set.entries:
        for stage, seconds in entry.stages.items():
            total[stage] = total.get(stage, 0.0) + seconds
    return total
