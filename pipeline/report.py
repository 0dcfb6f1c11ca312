"""What came of a build, for people: tables for the terminal, a page, and pictures of some plans."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from rich.table import Table

from houseexpo.drawing import Image, contact_sheet, draw_plan
from houseexpo.files import load_plan
from pipeline.assemble import DataSet
from pipeline.build import Progress
from pipeline.store import write

PICTURES = 60
"""How many plans a build draws: enough to look at, quick to make."""

RULES = {
    "boundary:floor_edge": "closed an open front by its floor",
    "boundary:wall_ends": "closed an open front by its walls' ends",
    "cuts": "cut a wall",
    "erased_parts": "erased a part standing apart",
    "filled_cells": "filled a closed cell",
    "filled_pockets": "filled a corner out of reach",
}
_TILE_PX = 320


def outcome_table(stats: Mapping[str, Any]) -> Table:
    """Show what became of the inputs, rejections by reason."""
    outcomes = stats["outcomes"]
    table = Table(title="Outcomes", title_justify="left", show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_row("inputs", str(outcomes["inputs"]), end_section=True)
    table.add_row("[green]plans[/]", str(outcomes["plans"]))
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


def write_report(data_set: DataSet, progress: Progress) -> None:
    """Write ``.build/report.html`` and the pictures it shows."""
    folder = data_set.root / ".build" / "pictures"
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    chosen = _spread(data_set.ids, PICTURES)
    images = []
    for name in chosen:
        images.append(draw_plan(load_plan(data_set.root / "json" / f"{name}.json"), size=_TILE_PX))
        save_png(images[-1], folder / f"{name}.png")
        progress("drawing", len(images), len(chosen))
    if images:
        save_png(contact_sheet(images, 6, [name[:20] for name in chosen]), folder / "sheet.png")
    write(data_set.root / ".build" / "report.html", _page(data_set, chosen).encode())


def save_png(image: Image, path: Path) -> None:
    """Write an RGB image (rows, cols, 3) uint8 as a PNG file."""
    from PIL import Image as Pillow

    Pillow.fromarray(image).save(path)


def _spread(names: Sequence[str], count: int) -> list[str]:
    """Return at most ``count`` of the names, evenly spread over them."""
    step = max(len(names) / count, 1.0)
    return [names[int(i * step)] for i in range(min(count, len(names)))]


def _page(data_set: DataSet, chosen: Sequence[str]) -> str:
    outcomes = data_set.stats["outcomes"]
    rows = [(key, outcomes[key]) for key in ("inputs", "plans", "duplicates", "rejected")]
    rows += [(f"rejected: {reason}", count) for reason, count in outcomes["reasons"].items()]
    rows += [(f"plans in which a rule {RULES.get(rule, rule)}", count) for rule, count in outcomes["rules"].items()]
    cells = "\n".join(f"<tr><td>{escape(name)}<td>{count}" for name, count in rows)
    figures = "\n".join(_FIGURE.format(name=escape(name)) for name in chosen)
    return _HTML.format(title=escape(data_set.root.name), cells=cells, figures=figures)


_FIGURE = '<figure><img src="pictures/{name}.png" loading="lazy"><figcaption>{name}</figcaption></figure>'
_HTML = """<!doctype html>
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; color: #222 }}
td {{ padding: .1rem 1.5rem .1rem 0 }} td + td {{ text-align: right; font-variant-numeric: tabular-nums }}
main {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: 1rem; margin-top: 2rem }}
figure {{ margin: 0; text-align: center; border: 1px solid #ddd; border-radius: .4rem; padding: .6rem }}
img {{ max-width: 100% }} figcaption {{ font-size: .75rem; color: #666; overflow-wrap: anywhere }}
</style>
<h1>{title}</h1>
<table>
{cells}
</table>
<main>
{figures}
</main>
"""
