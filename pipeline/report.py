"""What came of a build, for people, in the terminal: tables and lines; ``pipeline.report_page`` writes the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table

from houseexpo.quality import SURE
from pipeline.batch.assemble import DataSet

RULES = {
    "boundary:floor_edge": "closed an open front by its floor",
    "boundary:wall_ends": "closed an open front by its walls' ends",
    "cuts": "cut a wall",
    "erased_parts": "erased a part standing apart",
    "filled_cells": "filled a closed cell",
    "filled_pockets": "filled a corner out of reach",
}


def outcome_table(stats: Mapping[str, Any]) -> Table:
    """Show what became of the inputs, rejections by reason."""
    outcomes = stats["outcomes"]
    table = Table(title="Outcomes", title_justify="left", show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_row("inputs", str(outcomes["inputs"]), end_section=True)
    table.add_row("[green]plans[/]", str(outcomes["plans"]))
    if outcomes["doubtful"]:
        table.add_row(f"  doubtful: quality below {SURE:g}", str(outcomes["doubtful"]), style="yellow")
    table.add_row("[yellow]duplicates[/]", str(outcomes["duplicates"]))
    table.add_row("[red]rejected[/]", str(outcomes["rejected"]))
    for reason, count in outcomes["reasons"].items():
        table.add_row(f"  {reason}", str(count), style="dim")
    if outcomes["rules"]:
        table.add_section()
        table.add_row("plans in which a rule", "")
        for rule, count in outcomes["rules"].items():
            table.add_row(f"  {RULES.get(rule, rule)}", str(count), style="dim")
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


def reasons_lines(data_set: DataSet, most: int = 8) -> list[str]:
    """Say why each input was rejected where they are few; where they are many, only where that is written."""
    if len(data_set.refused) > most:
        return [f"why each of the {len(data_set.refused)} was rejected: {data_set.root / 'rejected.jsonl'}"]
    return [f"{r.id}: {r.detail}" + (f" ({r.advice})" if r.advice else "") for r in data_set.refused]
