"""Draw histograms, bars and plans as SVG for the report; they take colours and font from the page, light or dark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from houseexpo.analysis.measures import Measure
from houseexpo.drawing.plots import INK, MUTED, ONE, OTHER, embedded_svg, svg_axes
from stats.summary import Reach
from stats.tally import Tally

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
