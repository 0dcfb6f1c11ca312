"""Write the data card of a release (``README.md`` with the header Hugging Face reads), and draw its pictures (PNG)."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from houseexpo.analysis.measures import BY_NAME
from houseexpo.dataset import Dataset
from houseexpo.drawing import contact_sheet, draw_plan
from houseexpo.drawing.plots import plot_style
from houseexpo.exports.encoding import encode_image
from houseexpo.release.descriptions import KEYWORDS, ReleaseFacts, bibtex_entry
from houseexpo.release.tables import ReleaseTable
from houseexpo.tolerances import ROBOT_M

MEASURES: Final = "pictures/measures.png"
SHEET: Final = "pictures/plans.png"
_HUB_SPLITS: Final = {"val": "validation"}
_SIZES: Final = ((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))
_SIGNS: Final = re.compile(r"[\\`*\[\]<>|]|(?<!\w)_|_(?!\w)|(?<!/)~")
"""The characters of Markdown syntax, which are escaped by a backslash. Bare addresses are unchanged."""
_ROWS: Final = tuple(
    BY_NAME[name]
    for name in (
        *("rooms", "area", "long_side", "short_side", "room_area", "doors", "door_width", "furniture", "quality"),
    )
)
"""The measures in the table of the card."""


def make_data_card(facts: ReleaseFacts, tables: Sequence[ReleaseTable]) -> bytes:
    """Return the data card."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("houseexpo.release"),
        autoescape=False,  # noqa: S701  # Markdown; About has no line breaks in its words
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["words"] = _words
    text = environment.get_template("README.md.j2").render(
        header=_header(facts, tables),
        facts=facts,
        manifest=facts.material.manifest,
        tables=tables,
        measures=_measures(facts),
        part=next(iter(facts.parts.lists)),  # train, if there is one
        reach=[
            (radius, f"{100 * r['connected_share']:.1f}%") for radius, r in sorted(facts.stats["navigability"].items())
        ],
        hub_split=lambda part: _HUB_SPLITS.get(part, part),
        bibtex=bibtex_entry(facts),
        pictures=(SHEET, MEASURES),
    )
    return text.encode()


def _words(text: str) -> str:
    """Escape a text so that Markdown shows it literally: without HTML, links, pictures or emphasis."""
    return _SIGNS.sub(r"\\\g<0>", text)


def _header(facts: ReleaseFacts, tables: Sequence[ReleaseTable]) -> str:
    """Return the YAML that lists the tables for Hugging Face, which shows the first one."""
    import yaml

    parts = facts.parts.lists
    size = next((name for limit, name in _SIZES if facts.plans < limit), "1M<n<10M")
    configs: list[dict[str, Any]] = [
        {
            "config_name": table.name,
            **({"default": True} if number == 0 else {}),
            "data_files": [
                {"split": _HUB_SPLITS.get(part, part), "path": f"{table.name}/{part}.parquet"} for part in parts
            ],
        }
        for number, table in enumerate(tables)
    ]
    said = {
        "pretty_name": facts.title,
        "license": facts.material.licence.hub,
        "task_categories": ["robotics"],
        "size_categories": [size],
        "tags": list(KEYWORDS),
        "configs": configs,
    }
    text: str = yaml.safe_dump(said, sort_keys=False, allow_unicode=True, width=1000)
    return text


def _measures(facts: ReleaseFacts) -> list[tuple[str, ...]]:
    """Return the rows of the table of figures: name, mean, median, 5%, 95%."""
    rows = []
    for measure in _ROWS:
        tally = facts.stats.get(measure.key, {})
        if tally.get("count"):
            values = (f"{tally[key]:,.4g}" for key in ("mean", "median", "p05", "p95"))
            rows.append((measure.title.lower(), *(f"{value} {measure.unit}".rstrip() for value in values)))
    return rows


if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET_PLANS: Final = 24
_SHEET_COLUMNS: Final = 6
_SHEET_PX: Final = 300
_INK, _MUTED, _LINE, _BAR = "#2f343b", "#6b7280", "#d9dce1", "#2f6da8"
_LABELS_SHOWN: Final = 14
_CARD_TAIL: Final = 0.99  # the last bar includes everything beyond this share
_STYLE: Final[Any] = plot_style(_INK, _MUTED, _LINE) | {
    "font.family": "DejaVu Sans",  # comes with matplotlib, the same on every machine
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
}
_HISTOGRAMS: Final = tuple(BY_NAME[name] for name in ("rooms", "area", "long_side", "doors", "room_area", "narrowest"))
"""The measures whose distributions are drawn; ``narrowest`` is that of the usual robot."""


def draw_measures_png(stats: Mapping[str, Any]) -> bytes:
    """Draw the distributions of the plans in ``stats.json``."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    found = dict(stats)
    found["narrowest_m"] = stats.get("navigability", {}).get(f"{ROBOT_M:.2f}", {}).get("narrowest", {})
    shown = [measure for measure in _HISTOGRAMS if found.get(measure.key, {}).get("histogram")]
    rows = -(-len(shown) // 3)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(10.5, 2.5 * rows + 3.2), dpi=110, layout="constrained")
        grid = figure.add_gridspec(rows + 1, 6, height_ratios=[2.5] * rows + [3.2])
        for number, measure in enumerate(shown):
            row, place = divmod(number, 3)
            axes = figure.add_subplot(grid[row, 2 * place : 2 * place + 2])
            _histogram(axes, found[measure.key], measure.title, measure.unit)
        _labels(figure.add_subplot(grid[rows, :3]), stats["labels"])
        _reach(figure.add_subplot(grid[rows, 3:]), stats["navigability"])
        out = io.BytesIO()
        figure.savefig(out, format="png", facecolor="white", metadata={"Software": None})
    return out.getvalue()


def draw_sheet_png(plans: Dataset) -> bytes:
    """Draw a sheet of randomly chosen plans."""
    chosen = plans.sample(min(SHEET_PLANS, len(plans)), seed=0)
    return encode_image(contact_sheet([draw_plan(plan, size=_SHEET_PX) for plan in chosen], _SHEET_COLUMNS), "PNG")


def _histogram(axes: Axes, tally: Mapping[str, Any], title: str, unit: str) -> None:
    found = sorted((float(start), count) for start, count in tally["histogram"].items())
    starts, counts = np.array(found).T
    width = float(np.diff(starts).min()) if len(starts) > 1 else 1.0
    last = int(np.searchsorted(np.cumsum(counts), _CARD_TAIL * counts.sum()))
    heights = np.append(counts[:last], counts[last:].sum())
    axes.bar(starts[: last + 1], heights, width * 0.9, align="edge" if unit else "center", color=_BAR)
    axes.axvline(tally["median"], color=_INK, linewidth=1, linestyle=(0, (3, 2)))
    axes.set_title(f"{title}: median {tally['median']:,.4g}{f' {unit}' if unit else ''}")
    if last + 1 < len(starts):
        axes.annotate(f"{starts[last]:,.4g} and more", (1, 0), xytext=(0, 2), xycoords="axes fraction", ha="right",
                      textcoords="offset points", color=_MUTED, fontsize=7.5, rotation=90, va="bottom")  # fmt: skip
    axes.set_xlabel(unit)
    axes.yaxis.set_major_locator(_few_ticks())
    axes.yaxis.set_major_formatter("{x:,.0f}")


def _labels(axes: Axes, labels: Mapping[str, int]) -> None:
    shown = list(labels.items())[:_LABELS_SHOWN]
    names = [name.replace("_", " ") for name, _ in shown]
    bars = axes.barh(np.arange(len(shown)), [count for _, count in shown], 0.75, color=_BAR)
    axes.bar_label(bars, [f"{count:,}" for _, count in shown], padding=3, color=_MUTED, fontsize=7.5)
    axes.set_yticks(np.arange(len(shown)), names, color=_INK, fontsize=8)
    axes.invert_yaxis()
    axes.set_xticks([])
    axes.grid(visible=False)
    axes.spines["bottom"].set_visible(False)
    axes.margins(x=0.14)
    left = len(labels) - len(shown)
    axes.set_title("Rooms by label" + (f" ({left} rarer ones are left out)" if left > 0 else ""))


def _reach(axes: Axes, reach: Mapping[str, Mapping[str, Any]]) -> None:
    radii = sorted(reach)
    shares = [100 * reach[radius]["connected_share"] for radius in radii]
    axes.plot([float(radius) for radius in radii], shares, color=_BAR, linewidth=2, marker="o", markersize=4)
    for radius, share in zip(radii, shares, strict=True):
        axes.annotate(f"{share:.1f}", (float(radius), share), xytext=(0, 6), ha="center",
                      textcoords="offset points", fontsize=8, color=_INK)  # fmt: skip
    axes.set_ylim(max(min([*shares, 90]) - 2, 0), 102)
    axes.yaxis.set_major_locator(_few_ticks())
    axes.set_xticks([float(radius) for radius in radii])
    axes.yaxis.set_major_formatter("{x:.0f}%")
    axes.set_xlabel("radius of the robot, m")
    axes.set_title("Plans in which a robot gets everywhere")


def _few_ticks() -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(4, integer=True)
