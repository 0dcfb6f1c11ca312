"""Write the HTML report of a build, ``.build/report.html``, with pictures: what needs attention comes first.

Doubtful plans stand first, the least sure first, with what speaks against them; then rejections by stage and reason,
duplicates, plans drawn at random, and where the time went.
"""

from __future__ import annotations

import base64
import logging
import random
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from itertools import groupby
from typing import Final

import pyarrow.parquet as pq

from houseexpo.analysis.copies import Duplicate
from houseexpo.dataset.store.folders import rejected_picture_path
from houseexpo.drawing import draw_plan, svg, svg_sheet
from houseexpo.errors import HouseExpoError
from houseexpo.files import write_atomically
from houseexpo.floorplan import FloorPlan, decode, load_plan
from houseexpo.plan import explanations
from houseexpo.plan.parts import SURE
from pipeline.batch.assemble import BuildResult
from pipeline.batch.build import Progress
from pipeline.batch.entry import StoredRejection
from pipeline.batch.plan_store import DamagedPlanError, PlanStore
from pipeline.batch.result_store import FolderStore
from pipeline.png import encode_png
from pipeline.quality import main_grounds_in_words
from pipeline.terminal_report import slowest_inputs, sorted_rejections, stage_seconds

SHOWN: Final = 50
"""How many of the other plans are drawn, at random: enough to look at, quick to make."""

MAX_SHOWN: Final = 200
"""How many doubtful plans, and how many duplicates, are drawn; the data set has all of them."""

_GROUNDS: Final = (
    "The quality runs from 0 to 1. The main possible faults of a plan stand below it, each from 0 (no sign of it) to 1."
)
_LOG = logging.getLogger(__name__)
_ROWS: Final = 2000
_TILE_PX: Final = 320


def write_report(data_set: BuildResult, progress: Progress, corrections: Sequence[tuple[str, str, str]] = ()) -> None:
    """Write the page and the pictures that it shows; a page that cannot be made is said, and costs nothing else.

    ``corrections`` are those of ``terminal_report.outcomes_by_id``.

    Raises
    ------
    OSError
        Where the folder cannot be written to.
    """
    try:
        _write(data_set, progress, corrections)
    except OSError:
        raise
    except Exception as error:  # noqa: BLE001 - the data set stands already
        _LOG.warning("%s: the report cannot be made: %s", data_set.root, error)


def _write(data_set: BuildResult, progress: Progress, corrections: Sequence[tuple[str, str, str]]) -> None:
    folder = data_set.root / ".build" / "pictures"
    folder.mkdir(exist_ok=True)
    for old in (*folder.rglob("*.png"), *folder.rglob("*.svg")):
        old.unlink()
    _keep_pictures(data_set)
    doubtful = doubtful_ids(data_set)[:MAX_SHOWN]
    others = _sample_names([name for name in data_set.ids if name not in set(doubtful)], SHOWN)
    copies = data_set.duplicates
    wanted = dict.fromkeys([*doubtful, *others, *(copy.kept_id for copy in copies[:MAX_SHOWN])])
    plans = {name: load_plan(data_set.root / "json" / f"{name}.json") for name in wanted}
    plans |= _plans_beside(data_set, [copy.id for copy in copies[:MAX_SHOWN]])
    dropped = {copy.id for copy in copies}
    drawn: dict[str, str] = {}
    for done, (name, plan) in enumerate(plans.items(), 1):
        picture = _draw_plan(plan, in_pixels=name in dropped)
        if isinstance(picture, bytes):
            (folder / f"{name}.png").write_bytes(picture)
        elif picture is not None:
            drawn[name] = picture
            (folder / f"{name}.svg").write_text(picture, encoding="utf-8")
        progress("drawing", done, len(plans))
    if sheet_of := [name for name in (*doubtful, *others) if name in drawn][:SHOWN]:
        sheet = svg_sheet([drawn[name] for name in sheet_of], 6, [name[:20] for name in sheet_of])
        (folder / "sheet.svg").write_text(sheet, encoding="utf-8")
    count = data_set.stats["outcomes"]["doubtful"]
    some = ", some at random" if len(data_set.ids) > SHOWN else ""
    parts = (
        table_html((), list(_counts(data_set))),
        section_html(f"Corrections: {len(corrections)}", []),
        table_html(("id", "outcome", "correction"), sorted(corrections, key=lambda each: each[1] != "none")),
        section_html(f"Doubtful plans: {count}", [_plan_figure(plans[name]) for name in doubtful], _GROUNDS),
        *_rejections(data_set),
        section_html(f"Duplicates: {len(copies)}", [_duplicate_figure(copy) for copy in copies[:MAX_SHOWN]]),
        table_html(
            ("id", "repeats", "difference"), [(c.id, c.kept_id, f"{c.difference:.4f}") for c in copies[MAX_SHOWN:]]
        ),
        section_html(f"Plans{some}", [_plan_figure(plans[name]) for name in others]) if others else "",
        *_time(data_set),
    )
    html = page_html(data_set.root.name, parts)
    write_atomically(data_set.root / ".build" / "report.html", html.encode(), durable=True)


def _draw_plan(plan: FloorPlan, *, in_pixels: bool) -> str | bytes | None:
    """Draw a plan as SVG, or as PNG: `houseexpo serve` gives out dropped plans as such, and pixels take longer.

    One that cannot be drawn is said and passed over, and costs no other plan its picture.
    """
    try:
        return encode_png(draw_plan(plan, size=_TILE_PX), smallest=False) if in_pixels else svg(plan, size=_TILE_PX)
    except Exception as error:  # noqa: BLE001 - one plan's picture never ends a build
        _LOG.warning("%s: it cannot be drawn: %s", plan.id, error)
        return None


def doubtful_ids(data_set: BuildResult) -> list[str]:
    """Return the ids of the doubtful plans, the least sure first."""
    index = pq.read_table(data_set.root / "index.parquet", columns=["id", "quality"]).to_pylist()
    found = [(row["quality"], row["id"]) for row in index if row["quality"] is not None and row["quality"] < SURE]
    return [name for _, name in sorted(found)]


def _sample_names(names: Sequence[str], count: int) -> list[str]:
    """Return at most ``count`` of the names, at random but the same each time, sorted."""
    return sorted(random.Random(0).sample(names, min(count, len(names))))  # noqa: S311 - a choice of pictures


def _keep_pictures(data_set: BuildResult) -> None:
    """Write the pictures of what was refused, where `houseexpo serve` finds them."""
    for refused in (each for each in data_set.refused[:_ROWS] if each.picture):
        file = rejected_picture_path(data_set.root, refused.id)
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(refused.picture)


def _plans_beside(data_set: BuildResult, names: Sequence[str]) -> dict[str, FloorPlan]:
    """Return plans that are not in the data set from where the build keeps them, as far as they are still there."""
    store, found = PlanStore(FolderStore(data_set.root)), {}
    kept = {plan.id: plan for entry in data_set.entries for plan in entry.plans}
    for name in names:
        try:
            found[name] = decode(store.get(kept[name]))
        except (KeyError, DamagedPlanError, HouseExpoError):
            continue
    return found


def _counts(data_set: BuildResult) -> Iterator[tuple[str, str]]:
    outcomes = data_set.stats["outcomes"]
    yield from ((key, str(outcomes[key])) for key in ("inputs", "plans", "doubtful", "duplicates", "rejected"))
    yield from ((f"rejected: {reason}", str(count)) for reason, count in outcomes["reasons"].items())
    yield from (
        (f"plans in which a rule {explanations.NOTES.get(rule, rule)}", str(n)) for rule, n in outcomes["rules"].items()
    )


def _rejections(data_set: BuildResult) -> Iterator[str]:
    """Yield an example of each stage and reason, with a picture where there is one, and the list of all."""
    found = sorted(sorted_rejections(data_set), key=lambda pair: (pair[1].stage, pair[1].reason))
    figures = []
    for (stage, reason), group in groupby(found, lambda pair: (pair[1].stage, pair[1].reason)):
        those = list(group)
        file, example = next((pair for pair in those if pair[1].picture), those[0])
        figures.append(_refused_figure(f"{stage}: {reason}: {len(those)}", file, example))
    yield section_html(f"Rejected: {len(found)}", figures)
    rows = [(r.id, file, f"{r.stage}: {r.reason}", r.detail, r.advice) for file, r in found[:_ROWS]]
    yield table_html(("id", "file", "why", "found", "what to do"), rows)
    if len(found) > _ROWS:
        yield "<p>The others are in <code>rejected.jsonl</code>.</p>"


def _refused_figure(title: str, file: str, refused: StoredRejection) -> str:
    source = f"data:image/png;base64,{base64.b64encode(refused.picture).decode()}" if refused.picture else ""
    return figure_html(source, [title, f"for example {refused.id}", file, refused.detail, refused.advice])


def _duplicate_figure(copy: Duplicate) -> str:
    lines = [f"{copy.id} repeats {copy.kept_id}", f"difference {copy.difference:.4f}, {copy.symmetry}"]
    return figure_html([f"pictures/{copy.id}.png", f"pictures/{copy.kept_id}.svg"], lines)


def _plan_figure(plan: FloorPlan) -> str:
    lines = [plan.id]
    if plan.quality is not None:
        lines.append(f"quality {plan.quality.score:.2f}")
        lines += main_grounds_in_words(plan.quality) if plan.quality.is_doubtful else []
    return figure_html(f"pictures/{plan.id}.svg", lines)


def _time(data_set: BuildResult) -> Iterator[str]:
    """Yield where the time went, by stage, and which inputs took longest."""
    seconds = stage_seconds(data_set)
    if total := sum(seconds.values()):
        rows = [(stage, f"{value:.1f} s", f"{value / total:.0%}") for stage, value in seconds.items()]
        yield section_html("Time", [])
        yield table_html(("stage", "of one core", "share"), rows)
        slow = [(name, file, f"{value:.2f}") for name, file, value in slowest_inputs(data_set)]
        yield table_html(("longest", "file", "seconds"), slow)


# The parts of a page for people: sections of figures, tables; every text is escaped here and nowhere else.


def page_html(title: str, parts: Iterable[str]) -> str:
    """Return a whole page; ``parts`` are HTML."""
    return _PAGE.format(title=escape(title), parts="\n".join(part for part in parts if part))


def section_html(title: str, figures: Sequence[str], said: str = "") -> str:
    """Return a heading with a sentence and figures under it, or nothing if the title ends in a count of none."""
    if title.endswith(": 0"):
        return ""
    shown = "\n".join(figures)
    about = f"\n<p>{escape(said)}</p>" if said else ""
    return f"<h2>{escape(title)}</h2>{about}" + (f"\n<main>\n{shown}\n</main>" if figures else "")


def table_html(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table, or nothing if it has no rows."""
    if not rows:
        return ""
    head = "<tr>" + "".join(f"<th>{escape(heading)}" for heading in headings) + "\n" if headings else ""
    body = "\n".join("<tr>" + "".join(f"<td>{escape(cell)}" for cell in row) for row in rows)
    return f'<div class="wide"><table>\n{head}{body}\n</table></div>'


def figure_html(sources: str | Sequence[str], lines: Iterable[str]) -> str:
    """Return the pictures that exist, with lines of text under them."""
    found = [sources] if isinstance(sources, str) else sources
    images = "".join(
        f'<a href="{escape(source)}"><img src="{escape(source)}" alt="" loading="lazy"></a>'
        for source in found
        if source
    )
    caption = "<br>".join(escape(line) for line in lines if line)
    return f"<figure>{images}<figcaption>{caption}</figcaption></figure>"


_PAGE: Final = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
:root {{ color-scheme: light dark }}
body {{ font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem }}
table {{ border-collapse: collapse; margin: 1rem 0 }}
th, td {{ padding: .1rem 1.5rem .1rem 0; text-align: left; vertical-align: top; max-width: 26rem }}
td {{ overflow-wrap: break-word }}
.wide {{ overflow-x: auto }}
td:nth-child(2) {{ font-variant-numeric: tabular-nums }}
main {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(min(15rem, 100%), 1fr)) }}
main {{ gap: 1rem; margin-top: 1rem }}
figure {{ margin: 0; text-align: center; border: 1px solid #8884; border-radius: .4rem; padding: .6rem }}
img {{ max-width: 100%; background: #fff }}
figcaption {{ font-size: .75rem; opacity: .75; overflow-wrap: anywhere }}
</style>
<h1>{title}</h1>
{parts}
</html>
"""
