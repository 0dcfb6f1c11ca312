"""Write compared results as one self-contained HTML page, or as Markdown with pictures in a folder.

Both have tables, and curves with bands.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from houseexpo.drawing.plots import SERIES, embedded_svg, standalone_svg, svg_axes
from houseexpo.errors import ConfigError
from houseexpo.files import write_atomically
from houseexpo.pseudoslam.benchmark.colours import Colours, assign_colours, colour_keys
from houseexpo.pseudoslam.benchmark.comparison import TrackComparison
from houseexpo.pseudoslam.benchmark.map_curves import draw_map_panels
from houseexpo.pseudoslam.benchmark.tables import (
    ABOUT,
    HEADING,
    INTERVAL_HEADS,
    describe_plans,
    format_interval_rows,
    format_markdown,
    row_title,
    table_heads,
    table_row,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SUFFIXES: Final = (".html", ".md")
_SIZE: Final = (6.2, 3.6)
_WIDE: Final = (8.4, 3.6)  # including a legend on the right


@dataclass(frozen=True)
class TextTable:
    """The heads and rows of a table, as text."""

    heads: list[str]
    rows: list[list[str]]


def check_file_name(file: Path) -> None:
    """Raise ConfigError if a comparison cannot be written under a file name."""
    if file.suffix not in SUFFIXES:
        raise ConfigError(f"--out: expected a file that ends in {' or '.join(SUFFIXES)}, found {file.name!r}")


def write_comparison(
    found: Sequence[TrackComparison],
    file: Path,
    heading: str = HEADING,
    write: Callable[[Path, bytes], object] = write_atomically,
    *,
    each_map: bool = False,
) -> None:
    """Write a comparison as HTML or Markdown, by the extension; curves of ``page.md`` are in a folder ``page``.

    With ``each_map`` the page also has the curves on each map (``map_curves``).
    """
    check_file_name(file)
    if file.suffix == ".html":
        write(file, render_page(found, heading, each_map=each_map).encode())
        return
    pictures, colours = {}, assign_colours(found)
    for compared in found:
        for over, _ in compared.track.curves:
            picture = file.with_suffix("") / f"{compared.track.id}-{over}.svg"
            picture.parent.mkdir(exist_ok=True)
            with svg_axes(_WIDE) as (axes, out):
                _draw(axes, compared, over, colours)
                axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))  # beside the lines
            write(picture, standalone_svg(out).encode())
            pictures[compared.track.id, over] = f"{picture.parent.name}/{picture.name}"
    more: dict[str, list[tuple[str, str]]] = {}
    for compared in found if each_map else ():
        for number, (about, out) in enumerate(draw_map_panels(compared, colours), start=1):
            picture = file.with_suffix("") / f"{compared.track.id}-maps-{number}.svg"
            picture.parent.mkdir(exist_ok=True)
            write(picture, standalone_svg(out).encode())
            more.setdefault(compared.track.id, []).append((about, f"{picture.parent.name}/{picture.name}"))
    write(file, format_markdown(found, heading, pictures, more).encode())


def render_page(found: Sequence[TrackComparison], heading: str = HEADING, *, each_map: bool = False) -> str:
    """Return the page; ``each_map`` as in ``write_comparison``."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("houseexpo.pseudoslam.benchmark", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    colours = assign_colours(found)
    sections = [
        (
            *(each, describe_plans(each), list(_tables(each)), _legend(each, colours), list(_curves(each, colours))),
            [(describe_policy, embedded_svg(out)) for describe_policy, out in draw_map_panels(each, colours)]
            if each_map
            else [],
        )
        for each in found
    ]
    return environment.get_template("page.html.j2").render(sections=sections, heading=heading, about=ABOUT)


def _tables(compared: TrackComparison) -> Iterator[TextTable]:
    for metrics in compared.tables():
        yield TextTable(table_heads(metrics), [table_row(compared, entry, metrics) for entry in compared.rows(metrics)])
    if rows := format_interval_rows(compared):
        yield TextTable(INTERVAL_HEADS, rows)


def _legend(compared: TrackComparison, colours: Colours) -> list[tuple[int, str]]:
    """Return the number of the colour and the name of each row that has curves."""
    rows = zip(colour_keys(compared), compared.plain, strict=True)
    return [(colours[key], row_title(entry)) for key, entry in rows if key in colours]


def _curves(compared: TrackComparison, colours: Colours) -> Iterator[tuple[str, str]]:
    """Yield the quantity over which coverage is drawn, and the drawing."""
    for over, _ in compared.track.curves:
        with svg_axes(_SIZE) as (axes, out):
            _draw(axes, compared, over, colours)
        yield over, embedded_svg(out)


def _draw(axes: Axes, compared: TrackComparison, over: str, colours: Colours) -> None:
    """Draw the curves of all rows, with their bands."""
    for key, entry in zip(colour_keys(compared), compared.plain, strict=True):
        if not entry.has_curve(over):
            continue
        curve, colour = entry.curve(over), SERIES[colours[key]]
        low, mean, high = ([100 * value for value in part] for part in (curve.low, curve.mean, curve.high))
        axes.fill_between(curve.at, low, high, color=colour, alpha=0.18, linewidth=0)
        axes.plot(curve.at, mean, color=colour, linewidth=1.8, label=row_title(entry))
    axes.set_xlim(0, dict(compared.track.curves)[over])
    axes.set_ylim(0, 100)
    axes.yaxis.set_major_formatter("{x:.0f}%")
    axes.set_xlabel(over)
