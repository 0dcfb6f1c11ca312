"""Make plain matplotlib axes for plots, and return the plots as SVG, in the colours of their page or standalone."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, MUTED, GRID, ONE, OTHER = "#010101", "#020202", "#030303", "#040404", "#050505"
SERIES: Final = tuple(f"#0101{number:02d}" for number in range(10, 28))
"""Colours for more than two series: the page's variables ``--series-0`` and so on."""
_VARIABLES: Final = {
    INK: "--ink", MUTED: "--muted", GRID: "--line", ONE: "--one", OTHER: "--other",
    **{colour: f"--series-{number}" for number, colour in enumerate(SERIES)},
}  # fmt: skip
"""Colours that matplotlib draws with, and the page's variables that replace them."""

_COLOURS: Final = (
    "#2b6f8f", "#d9772b", "#3c8d53", "#a8423f", "#7a5aa6", "#8a6d3b", "#c25a94", "#5c6670", "#9a9a1f", "#1fa3a8",
    "#d4a017", "#3f4fb0", "#111417", "#8ec5ea", "#f08a7d", "#8fcf5a",
    "#b59ad6", "#0a5a4a",
)  # fmt: skip
_FIXED: Final = {
    "--ink": "#1d2328", "--muted": "#626c75", "--line": "#e2e0da", "--one": "#2b6f8f", "--other": "#d9772b",
    **{f"--series-{number}": colour for number, colour in enumerate(_COLOURS)},
}  # fmt: skip
"""The values of the page's variables without a page: the colours of its light theme."""


def plot_style(ink: str, muted: str, line: str) -> dict[str, Any]:
    """Return matplotlib settings for plain plots, given the colours of titles, of other text and of lines."""
    return {
        "text.color": ink,
        "axes.edgecolor": line,
        "axes.labelcolor": muted,
        "axes.titlecolor": ink,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.spines.left": False,
        "axes.axisbelow": True,
        "axes.grid": True,
        "axes.grid.axis": "y",
        "grid.color": line,
        "xtick.color": line,
        "ytick.color": line,
        "xtick.labelcolor": muted,
        "ytick.labelcolor": muted,
    }


_STYLE: Final[Any] = plot_style(INK, MUTED, GRID) | {
    "svg.fonttype": "none",  # keep text as text: it scales, can be searched and takes the page's font
    "svg.hashsalt": "houseexpo",
    "font.size": 10.5,
    "grid.linewidth": 0.8,
    "ytick.major.size": 0,
    "xtick.major.size": 3,
}


@contextmanager
def svg_axes(size: tuple[float, float]) -> Iterator[tuple[Axes, io.StringIO]]:
    """Yield axes of this size in inches, and a buffer that holds their SVG when the context ends."""
    with svg_figure(size) as (figure, out):
        yield figure.subplots(), out


@contextmanager
def svg_figure(size: tuple[float, float]) -> Iterator[tuple[Figure, io.StringIO]]:
    """Yield an empty figure of this size in inches, and a buffer that holds its SVG when the context ends."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    out = io.StringIO()
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=size, layout="constrained")
        yield figure, out
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None, "Creator": None})


def standalone_svg(out: io.StringIO) -> str:
    """Return a plot as a standalone SVG file, on white and in fixed colours."""
    text = embedded_svg(out).replace("<svg", '<svg style="background: #ffffff; font-family: sans-serif"', 1)
    for variable, colour in _FIXED.items():
        text = text.replace(f"var({variable})", colour)
    return f"{text}\n"


def embedded_svg(out: io.StringIO) -> str:
    """Return the SVG for embedding in a page: without prologue or size, and with ids that are unique among plots."""
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.DOTALL)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1)
    text = re.sub(r'<g id="[^"]*"', "<g", text)
    text = re.sub(r" font-family: [^;\"]*;", "", text)
    text = re.sub(r"<defs>\s*<style.*?</defs>\s*", "", text, count=1, flags=re.DOTALL)
    for colour, variable in _VARIABLES.items():
        text = text.replace(colour, f"var({variable})")
    return text.replace("<svg", '<svg role="img"', 1)
