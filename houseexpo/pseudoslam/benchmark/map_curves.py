"""Draw coverage over metres on each map: a panel a map, a line a policy, and thin lines where a map has several starts.

R1  A map's curve is the mean over its starts and over the trainings of a policy.
R2  The panels are in the order of the maps' names, with numbers in them by their value, ``PANELS`` in a picture. They
    have one horizontal axis, which ends where the last policy has reached its last coverage, at most at the end of the
    track's curve. Small panels show each second place, so that pictures of 100 maps stay small.
R3  A result without curves of each map, such as one of an earlier version, is left out.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.drawing.plots import SERIES, svg_figure
from houseexpo.pseudoslam.benchmark.colours import Colours, assign_colours, colour_keys
from houseexpo.pseudoslam.benchmark.comparison import ComparisonRow, TrackComparison
from houseexpo.pseudoslam.benchmark.tables import row_title

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
