"""Write a report as one self-contained HTML page (plots as vectors, numbers as tables, light and dark) or as JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.analysis.audit import RULES
from houseexpo.analysis.measures import Measure
from houseexpo.drawing.plots import INK, MUTED, ONE, OTHER, embedded_svg, svg_axes
from houseexpo.errors import ConfigError
from houseexpo.files import encode_json, write_atomically
from houseexpo.tolerances import ROBOT_M
from stats.audit import CITED, PUBLIC, SIZES, AuditSummary
from stats.record import BY_KEY
from stats.report import Report, audited_data_sets, count_leaks
from stats.summary import Reach
from stats.tally import Tally
from stats.terminal_tables import format_mean, format_quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_CARD = (4.3, 2.7)
_WIDE = (5.0, 2.7)
_ROBOT = f"{ROBOT_M:.2f}"


@dataclass(frozen=True)
class MeasurePlot:
    """The plot of a measure with its texts; ``rows`` are the numbers below it."""

    title: str
    about: str
    svg: str
    rows: Sequence[tuple[str, str]] = ()


def report_html(report: Report) -> str:
    """Return the page."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("stats"), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters.update(number=format_quantity, mean=format_mean)
    return environment.get_template("report.html.j2").render(
        report=report,
        one=report.one,
        other=report.other,
        whole=report.one.whole,
        counted=report.one.whole.room_measure,
        rings=report.one.whole.rings.report(),
        rooms=_histogram(report, report.one.whole.room_measure.key, _WIDE),
        area=_histogram(report, "area_m2", _WIDE),
        labels=_labels(report),
        groups=[(title, plots) for title, names in _GROUPS if (plots := list(_plots(report, names)))],
        reach=list(_reach(report)),
        audit=report.one.whole.audit,
        rules=RULES,
        audited=audited_data_sets(report),
        public=PUBLIC,
        cited=CITED,
        sizes=list(_sizes(report.one.whole.audit)),
        leaks=count_leaks(report.one),
        distances=report.distances,
    )


_GROUPS = (
    ("Size", ("source_rooms", "long_side_m", "short_side_m", "vertices", "holes", "label_boxes")),
    (
        "Rooms and doors",
        ("room_area_m2", "doors", "door_width_m", "doors_per_room", "degree", "loops", "depth"),
    ),
)


def _histogram(report: Report, name: str, size: tuple[float, float] = _CARD) -> MeasurePlot:
    measure, tally = BY_KEY[name], report.one.whole.tallies[name]
    other = None if report.other is None else report.other.whole.tallies[name]
    found = tally.report()
    keys = {"mean": "mean", "median": "median", "5%": "p05", "95%": "p95", "min": "min", "max": "max"}
    rows = [(title, format_quantity(found[key], measure.unit)) for title, key in keys.items()]
    return MeasurePlot(measure.title, measure.about, draw_histogram(measure, tally, other, size=size), rows)


def _plots(report: Report, names: Sequence[str]) -> Iterator[MeasurePlot]:
    """Yield a plot for each measure that the plans have and that is not equal for all of them."""
    for name in names:
        tally = report.one.whole.tallies[name]
        if len(tally.values()[0]) > 1:
            yield _histogram(report, name)


def _labels(report: Report) -> MeasurePlot | None:
    counts = report.one.whole.labels
    other = None if report.other is None else report.other.whole.labels
    if not counts and not other:
        return None
    about = "Rooms by label; where a plan has no rooms as geometry, its label boxes."
    return MeasurePlot("Labels", about, draw_shares(counts, other, width=_WIDE[0]))


def _reach(report: Report) -> Iterator[MeasurePlot]:
    one, other = report.one.whole, None if report.other is None else report.other.whole
    rows = [(f"{radius} m", f"{reach.connected:,}") for radius, reach in sorted(one.reach.items())]
    about = "Share of the plans in which a round robot gets to every place that it fits into."
    drawing = draw_reach(one.reach, None if other is None else other.reach, size=_CARD)
    yield MeasurePlot("Navigable plans", about, drawing, rows)
    here, there = (None if s is None else s.reach[_ROBOT].narrowest for s in (one, other))
    if here is not None and here.count:
        measure = Measure("narrowest", "Narrowest passage", lambda _: None, "m", here.step, here.bin_width)
        found = here.report()
        rows = [(key, format_quantity(found[key], "m")) for key in ("mean", "median", "min", "max")]
        about = f"That a robot of {_ROBOT} m radius has to take to get about; the width of a house of one space."
        yield MeasurePlot(measure.title, about, draw_histogram(measure, here, there, size=_CARD), rows)


def _sizes(found: AuditSummary) -> Iterator[tuple[str, int, list[str], list[str]]]:
    """Yield, for each type of room, how many there are, its areas and median width, and those of public data sets."""
    for kind, tally in sorted(found.areas.items(), key=lambda each: -each[1].count):
        ends = "/".join(f" {tally.quantile(share):.1f} " for share in (0.05, 0.5, 0.95)).strip()
        here = [ends, f"{found.widths[kind].quantile(0.5):.1f}"]
        known = (sizes.get(kind) for sizes in SIZES.values())
        there = ["" if each is None else " / ".join(f"{value:.1f}" for value in each[:3]) for each in known]
        yield kind, tally.count, here, there


def check_report_paths(files: Iterable[Path]) -> None:
    """Raise ConfigError if a report cannot be written under a file name."""
    for path in files:
        if path.suffix not in _WRITERS:
            raise ConfigError(f"--out: expected a file that ends in {' or '.join(_WRITERS)}, found {path.name!r}")


def write_statistics(report: Report, path: Path) -> None:
    """Write the page or the numbers, depending on the file's extension."""
    write_atomically(path, _WRITERS[path.suffix](report))


_WRITERS: Final[dict[str, Callable[[Report], bytes]]] = {
    ".html": lambda report: report_html(report).encode(),
    ".json": lambda report: encode_json(report.values()),
}


# Draw histograms, bars and plans as SVG for the report; they take colours and font from the page, light or dark.


_LABEL = 0.25  # the share of a histogram's width that the label of its last bar needs at most
_TAIL = 0.98  # the histogram's last bar includes everything beyond this share


def draw_histogram(measure: Measure, tally: Tally, other: Tally | None = None, *, size: tuple[float, float]) -> str:
    """Draw a distribution with its median, or two distributions as shares. ``size`` is in inches."""
    from matplotlib.ticker import MaxNLocator

    tallies = [tally] if other is None or not other.count else [tally, other]
    low = min(t.values()[0][0] for t in tallies) // measure.bin_width
    high = max(max(t.quantile(_TAIL) for t in tallies) // measure.bin_width, low)
    cut = any(t.values()[0][-1] // measure.bin_width > high for t in tallies)
    edges = np.arange(low, high + 2) * measure.bin_width
    centred = measure.bin_width == measure.step  # whole numbers: a bar is centred on its number
    edges = edges - measure.bin_width / 2 if centred else edges
    highest = 0.0
    with svg_axes(size) as (axes, out):
        for shown, colour in zip(tallies, (ONE, OTHER), strict=False):
            heights = _heights(shown, edges, measure.step) * (100 / shown.count if len(tallies) > 1 else 1)
            _bars(axes, edges, heights, colour, outline=shown is other)
            highest = max(highest, heights[edges[1:] > edges[-1] - _LABEL * (edges[-1] - edges[0])].max())
        _mark(axes, "median", tally.quantile(0.5))
        _count_axis(axes, percent=len(tallies) > 1)
        axes.set_xlim(edges[0], edges[-1])
        if centred:
            axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
        if cut:
            first = edges[-2] + (measure.bin_width / 2 if centred else 0)
            axes.annotate(f"{first:,.4g} and more", (edges[-1], highest), xytext=(0, 3), ha="right",
                          textcoords="offset points", color=MUTED, fontsize=9)  # fmt: skip
        axes.set_xlabel(measure.unit)
    return embedded_svg(out)


def draw_shares(counts: Mapping[str, int], other: Mapping[str, int] | None = None, *, width: float) -> str:
    """Draw named counts as bars, the largest on top, or two sets of counts as shares. ``width`` is in inches."""
    words = sorted({*counts, *(other or {})}, key=lambda word: (-counts.get(word, 0), word))
    places = np.arange(len(words))
    groups = [counts] if not other else [counts, other]
    tall = 0.8 / len(groups)
    with svg_axes((width, 0.5 + 0.225 * len(words) * (1 if len(groups) == 1 else 1.4))) as (axes, out):
        for i, (group, colour) in enumerate(zip(groups, (ONE, OTHER), strict=False)):
            total = max(sum(group.values()), 1)  # one of two groups may be empty
            values = np.array([group.get(word, 0) for word in words]) * (100 / total if len(groups) > 1 else 1)
            bars = axes.barh(places + (i - (len(groups) - 1) / 2) * tall, values, tall * 0.92, color=colour)
            text = [f"{v:,.0f}" if len(groups) == 1 else f"{v:.1f}%" for v in values]
            axes.bar_label(bars, text, padding=4, color=MUTED, fontsize=9 if len(groups) == 1 else 8)
        axes.set_yticks(places, [word.replace("_", " ") for word in words])
        axes.tick_params(axis="y", labelcolor=INK)
        axes.invert_yaxis()
        axes.set_ylim(len(words) - 0.4, -0.6)
        axes.set_xlim(0, axes.get_xlim()[1] * 1.12)
        axes.set_xticks([])
        axes.grid(visible=False)
        axes.spines["bottom"].set_visible(False)
    return embedded_svg(out)


def draw_reach(reach: Mapping[str, Reach], other: Mapping[str, Reach] | None, *, size: tuple[float, float]) -> str:
    """Draw the share of plans in which a robot can reach everything, over its radius."""
    with svg_axes(size) as (axes, out):
        for found, colour in zip((reach, other or {}), (ONE, OTHER), strict=True):
            radii = sorted(found)
            values = [100 * found[radius].connected_share for radius in radii]
            axes.plot([float(r) for r in radii], values, color=colour, linewidth=2, marker="o", markersize=5)
            below = colour == OTHER
            for radius, value in zip(radii, values, strict=True):
                axes.annotate(f"{value:.1f}", (float(radius), value), xytext=(0, -14 if below else 8), ha="center",
                              textcoords="offset points", fontsize=10)  # fmt: skip
        low = min(axes.get_ylim()[0], 90)
        axes.set_ylim(max(low - 6, 0), 104)
        axes.margins(x=0.08)
        axes.set_xticks([float(radius) for radius in sorted(reach)])
        axes.yaxis.set_major_formatter("{x:.0f}%")
        axes.set_xlabel("radius of the robot, m")
    return embedded_svg(out)


def _heights(tally: Tally, edges: npt.NDArray[np.float64], step: float) -> npt.NDArray[np.float64]:
    """Return the height of each bin; the last one includes everything beyond it."""
    values, counts = tally.values()
    inside = np.minimum(values + step / 1e3, (edges[-2] + edges[-1]) / 2)  # an edge belongs to the bin above
    return np.histogram(inside, edges, weights=counts)[0].astype(np.float64)


def _bars(axes: Axes, edges: Sequence[float] | Any, heights: Any, colour: str, *, outline: bool) -> None:
    if outline:
        axes.stairs(heights, edges, color=colour, linewidth=1.8)
    else:
        axes.bar(edges[:-1], heights, np.diff(edges) * 0.9, align="edge", color=colour)


def _mark(axes: Axes, name: str, value: float) -> None:
    """Draw a vertical line, with its name on the side with more space."""
    axes.axvline(value, color=INK, linewidth=1, linestyle=(0, (3, 2)))
    left, right = axes.get_xlim()
    after = value < (left + right) / 2
    axes.annotate(
        f"{name} {value:,.4g}", (value, 1.0), xycoords=("data", "axes fraction"), xytext=(5 if after else -5, -3),
        textcoords="offset points", va="top", ha="left" if after else "right",
    )  # fmt: skip


def _count_axis(axes: Axes, *, percent: bool) -> None:
    from matplotlib.ticker import MaxNLocator

    axes.yaxis.set_major_locator(MaxNLocator(4, integer=not percent))
    axes.yaxis.set_major_formatter("{x:g}%" if percent else "{x:,.0f}")
    axes.margins(y=0.14)
