"""The page about a build, ``.build/report.html``: what a person should look at comes first.

Doubtful plans stand first, the least sure first, with what speaks against them; then rejections of which there is a
picture; then some of the other plans.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator, Sequence
from html import escape
from typing import Final

import pyarrow.parquet as pq

from houseexpo.drawing import contact_sheet, draw_plan
from houseexpo.files import load_plan
from houseexpo.plan import FloorPlan
from houseexpo.quality import SURE
from pipeline.batch.assemble import DataSet
from pipeline.batch.build import Progress
from pipeline.batch.disk import write
from pipeline.batch.entry import Refused
from pipeline.png import as_png
from pipeline.quality import main_grounds
from pipeline.report import RULES

PICTURES: Final = 60
"""How many of the other plans are drawn: enough to look at, quick to make."""

MOST: Final = 200
"""How many doubtful plans, and how many rejections, are shown; the data set has all of them."""

_TILE_PX: Final = 320


def write_report(data_set: DataSet, progress: Progress) -> None:
    """Write the page and the pictures that it shows."""
    folder = data_set.root / ".build" / "pictures"
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.png"):
        old.unlink()
    doubtful = doubtful_ids(data_set)[:MOST]
    chosen = _spread([name for name in data_set.ids if name not in set(doubtful)], PICTURES)
    plans, images = [], []
    for name in (*doubtful, *chosen):
        plans.append(load_plan(data_set.root / "json" / f"{name}.json"))
        images.append(draw_plan(plans[-1], size=_TILE_PX))
        (folder / f"{name}.png").write_bytes(as_png(images[-1]))
        progress("drawing", len(images), len(doubtful) + len(chosen))
    if images:
        shown = slice(PICTURES)
        sheet = contact_sheet(images[shown], 6, [plan.id[:20] for plan in plans[shown]])
        (folder / "sheet.png").write_bytes(as_png(sheet))
    page = _page(data_set, plans[: len(doubtful)], plans[len(doubtful) :])
    write(data_set.root / ".build" / "report.html", page.encode())


def doubtful_ids(data_set: DataSet) -> list[str]:
    """Return the ids of the doubtful plans, the least sure first."""
    index = pq.read_table(data_set.root / "index.parquet", columns=["id", "quality"]).to_pylist()
    found = [(row["quality"], row["id"]) for row in index if row["quality"] is not None and row["quality"] < SURE]
    return [name for _, name in sorted(found)]


def _spread(names: Sequence[str], count: int) -> list[str]:
    """Return at most ``count`` of the names, evenly spread over them."""
    step = max(len(names) / count, 1.0)
    return [names[int(i * step)] for i in range(min(count, len(names)))]


def _page(data_set: DataSet, doubtful: Sequence[FloorPlan], others: Sequence[FloorPlan]) -> str:
    pictured = [refused for refused in data_set.refused if refused.picture][:MOST]
    outcomes = data_set.stats["outcomes"]
    parts = [
        *_section(f"Doubtful plans: {outcomes['doubtful']}", [_plan_figure(plan) for plan in doubtful]),
        *_section(f"Rejected: {outcomes['rejected']}", [_refused_figure(refused) for refused in pictured]),
        *_section("Plans", [_plan_figure(plan) for plan in others]),
    ]
    rows = "\n".join(f"<tr><td>{escape(name)}<td>{count}" for name, count in _counts(data_set))
    return _HTML.format(title=escape(data_set.root.name), rows=rows, sections="\n".join(parts))


def _counts(data_set: DataSet) -> Iterator[tuple[str, int]]:
    outcomes = data_set.stats["outcomes"]
    yield from ((key, outcomes[key]) for key in ("inputs", "plans", "doubtful", "duplicates", "rejected"))
    yield from ((f"rejected: {reason}", count) for reason, count in outcomes["reasons"].items())
    yield from ((f"plans in which a rule {RULES.get(rule, rule)}", n) for rule, n in outcomes["rules"].items())


def _section(title: str, figures: Sequence[str]) -> list[str]:
    return [f"<h2>{title}</h2>", "<main>", *figures, "</main>"] if figures else []


def _plan_figure(plan: FloorPlan) -> str:
    lines = [plan.id]
    if plan.quality is not None:
        lines.append(f"quality {plan.quality.score:.2f}")
        lines += main_grounds(plan.quality) if plan.quality.is_doubtful else []
    return _figure(f"pictures/{plan.id}.png", lines)


def _refused_figure(refused: Refused) -> str:
    source = f"data:image/png;base64,{base64.b64encode(refused.picture).decode()}"
    return _figure(source, [refused.id, f"{refused.stage}: {refused.reason}", refused.detail, refused.advice])


def _figure(source: str, lines: Sequence[str]) -> str:
    caption = "<br>".join(escape(line) for line in lines if line)
    return f'<figure><img src="{escape(source)}" loading="lazy"><figcaption>{caption}</figcaption></figure>'


_HTML: Final = """<!doctype html>
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; color: #222 }}
td {{ padding: .1rem 1.5rem .1rem 0 }} td + td {{ text-align: right; font-variant-numeric: tabular-nums }}
main {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: 1rem; margin-top: 1rem }}
figure {{ margin: 0; text-align: center; border: 1px solid #ddd; border-radius: .4rem; padding: .6rem }}
img {{ max-width: 100% }} figcaption {{ font-size: .75rem; color: #666; overflow-wrap: anywhere }}
</style>
<h1>{title}</h1>
<table>
{rows}
</table>
{sections}
"""
