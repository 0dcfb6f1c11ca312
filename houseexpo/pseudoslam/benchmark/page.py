"""Write compared results as Markdown with tables, and with pictures in a folder: curves with bands."""

from __future__ import annotations

import hashlib
import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from houseexpo.drawing.plots import SERIES, standalone_svg, svg_axes, svg_figure
from houseexpo.errors import ConfigError
from houseexpo.files import write_atomically
from houseexpo.pseudoslam.benchmark.comparison import ComparisonRow, TrackComparison
from houseexpo.pseudoslam.benchmark.tables import HEADING, format_markdown, row_title

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDE: Final = (8.4, 3.6)  # including a legend on the right


def check_file_name(file: Path) -> None:
    """Raise ConfigError if a comparison cannot be written under a file name."""
    if file.suffix != ".md":
        raise ConfigError(f"--out: expected a file that ends in .md, found {file.name!r}")


def write_comparison(
    found: Sequence[TrackComparison],
    file: Path,
    heading: str = HEADING,
    write: Callable[[Path, bytes], object] = write_atomically,
    *,
    each_map: bool = False,
) -> None:
    """Write a comparison as Markdown; curves of ``page.md`` are in a folder ``page``.

    With ``each_map`` the page also has the curves on each map (``draw_map_panels``).
    """
    check_file_name(file)
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


# Draw coverage over metres on each map: a panel a map, a line a policy, and thin lines where a map has several starts.
#
# R1  A map's curve is the mean over its starts and over the trainings of a policy.
# R2  The panels are in the order of the maps' names, with numbers in them by their value, ``PANELS`` in a picture. They
#     have one horizontal axis, which ends where the last policy has reached its last coverage, at most at the end of
#     the track's curve. Small panels show each second place, so that pictures of 100 maps stay small.
# R3  A result without curves of each map, such as one of an earlier version, is left out.


PANELS: Final = 20
_COLUMNS: Final = 5
_FEW_PANELS: Final = 8
"""So many panels or fewer are drawn three in a row, and larger."""
_OVER: Final = "metres"
Floats = npt.NDArray[np.float64]


class MapCurves(NamedTuple):
    """A policy's curves: the places (n,) in metres, and for each map the coverage (starts, n) of each start."""

    at: Floats
    maps: dict[str, Floats]


def collect_map_curves(entry: ComparisonRow) -> MapCurves | None:
    """Return the curves on each map (R1), means over trainings; None without such curves (R3)."""
    found = [one.map_curves for one in entry.results]
    kept = [curves[_OVER] for curves in found if isinstance(curves, dict) and _OVER in curves]
    if len(kept) < len(found):
        return None
    mean = np.mean(np.array(kept, np.float64), axis=0)
    plans = np.array(entry.results[0].episodes["plan"])
    maps = {name: mean[plans == name] for name in sorted(set(plans.tolist()), key=_in_order)}
    return MapCurves(np.array(entry.results[0].curves[_OVER].at), maps)


def draw_map_panels(compared: TrackComparison, colours: Colours | None = None) -> Iterator[tuple[str, io.StringIO]]:
    """Yield a text on each picture and its SVG; none for tracks whose results have no curves of each map.

    ``colours`` are those of the whole comparison; by default, the track is all of it.
    """
    colours = assign_colours([compared]) if colours is None else colours
    lines = [
        (SERIES[colours[key]], entry, curves)
        for key, entry in zip(colour_keys(compared), compared.plain, strict=True)
        if (curves := collect_map_curves(entry)) is not None
    ]
    if not lines:
        return
    names = list(lines[0][2].maps)
    end = max(_end(curves) for _, _, curves in lines)
    for first in range(0, len(names), PANELS):
        shown = names[first : first + PANELS]
        columns = 3 if len(names) <= _FEW_PANELS else _COLUMNS
        rows = -(-len(shown) // columns)
        width, height = (2.9, 2.1) if columns == 3 else (1.75, 1.45)
        with svg_figure((columns * width, rows * height + 0.5)) as (figure, out):
            panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
            for panel, name in zip(panels.flat, shown, strict=False):
                for colour, _, curves in lines:
                    places = np.flatnonzero(curves.at <= end)[:: 1 if columns == 3 else 2]
                    at, starts = curves.at[places], 100 * curves.maps[name][:, places]
                    if len(starts) > 1:
                        panel.plot(at, starts.T, color=colour, linewidth=0.5, alpha=0.45)
                    panel.plot(at, starts.mean(axis=0), color=colour, linewidth=1.6)
                panel.set_title(name, fontsize=8)
                panel.tick_params(labelsize=7)
            for panel in panels.flat[len(shown) :]:
                panel.set_visible(False)
            panels[0, 0].set_xlim(0, end)
            panels[0, 0].set_ylim(0, 100)
            panels[0, 0].yaxis.set_major_formatter("{x:.0f}%")
            figure.supxlabel(_OVER, fontsize=8)
            handles = [panels[0, 0].plot([], [], color=colour, label=row_title(e))[0] for colour, e, _ in lines]
            figure.legend(
                handles=handles, loc="outside upper left", ncols=min(len(lines), 4), frameon=False, fontsize=8
            )
        yield _about(lines[0][2], first, len(shown), len(names)), out


def _in_order(name: str) -> list[str | int]:
    """Return a key that sorts names by their text, and numbers in them by their value."""
    return [int(part) if part.isdecimal() else part for part in re.split(r"(\d+)", name)]


def _about(curves: MapCurves, first: int, number: int, every: int) -> str:
    starts = max(len(each) for each in curves.maps.values())
    which = f"Maps {first + 1} to {first + number} of {every}" if number < every else f"Each of {every} maps"
    thin = "; thin lines are single starts, thick ones their means" if starts > 1 else ""
    return f"{which}: coverage over metres{thin}."


def _end(curves: MapCurves) -> float:
    """Return the first place from which no curve grows (R2), metres."""
    every = np.concatenate(list(curves.maps.values()))
    grows = np.flatnonzero((np.diff(every, axis=1) > 0.0).any(axis=0))
    return float(curves.at[grows[-1] + 1]) if len(grows) else float(curves.at[-1])


# Assign a colour's number to each policy of a comparison, for the curves of its pages.
#
# C1  A policy has one colour in all pictures of a comparison. Trainings of one family are one policy.
# C2  The project's policies have the same colours in all comparisons. Others have one by their name, or the next free
#     one.
# C3  Two policies of one picture share a colour only if it has more policies than there are colours.


Colours: TypeAlias = Mapping[tuple[str, int], int]
"""The number of the colour of each policy: by its name, and by how many of that name came before it in a table."""

_OWN: Final = {
    "frontier": 0, "chooser": 1, "information": 2, "oracle": 3, "tour": 4, "wall": 5, "forward": 6, "random": 7,
    "frontier-mapex": 8, "random-frontier": 8, "PPO set": 9, "PPO cnn": 10, "PPO cnn-lstm": 11, "finisher": 12,
    "bound": 13, "look-around": 14, "swift": 15, "straight": 16, "prospector": 17,
}  # fmt: skip


def assign_colours(found: Sequence[TrackComparison]) -> Colours:
    """Return the colours of the policies of a comparison."""
    beside: dict[tuple[str, int], set[tuple[str, int]]] = {}
    for compared in found:
        drawn = {
            key for key, entry in zip(colour_keys(compared), compared.plain, strict=True) if _is_drawn(compared, entry)
        }
        for key in drawn:
            beside.setdefault(key, set()).update(drawn - {key})
    colours: dict[tuple[str, int], int] = {}
    for key in sorted(beside, key=lambda key: (key[1] > 0, _own(key[0]) is None, key)):
        own = _own(key[0])
        wanted = int(hashlib.sha256(key[0].encode()).hexdigest(), 16) % len(SERIES) if own is None else own
        taken = {colours[other] for other in beside[key] if other in colours}
        colours[key] = next((n for k in range(len(SERIES)) if (n := (wanted + k) % len(SERIES)) not in taken), wanted)
    return colours


def colour_keys(compared: TrackComparison) -> list[tuple[str, int]]:
    """Return the keys of the rows of ``compared.plain`` in ``Colours``."""
    names = [_name(entry) for entry in compared.plain]
    return [(name, names[:number].count(name)) for number, name in enumerate(names)]


def _is_drawn(compared: TrackComparison, entry: ComparisonRow) -> bool:
    return any(entry.has_curve(over) for over, _ in compared.track.curves)


def _name(entry: ComparisonRow) -> str:
    policy = entry.results[0].policy
    return policy.family or policy.name


def _own(name: str) -> int | None:
    """Return the colour of one of the project's policies; a family's name ends in a hash of its training."""
    return _OWN.get(name.rpartition(" ")[0] if name.startswith("PPO ") else name)
