"""Draw plans on matplotlib axes, for notebooks and papers, as in other pictures."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final

from houseexpo.drawing.room_names import LINE, SMALLEST_PX, TextLines
from houseexpo.drawing.scene import Parts, Scene, lay_out_plan
from houseexpo.drawing.styles import StyleName
from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.grids.frame import FEWEST_CELLS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from houseexpo.plan.model import PlanData

_PIXELS_AN_INCH: Final = 96.0
"""Of a picture: a figure of this resolution looks like ``draw_plan``."""
_POINTS: Final = 72.0 / _PIXELS_AN_INCH


def plot_plan(
    plan: PlanData,
    ax: Axes | None = None,
    *,
    rooms: bool = True,
    labels: bool = True,
    doors: bool = True,
    objects: bool = True,
    walls: bool = True,
    wall_thickness: float = 0.1,
    title: str | None = None,
    figsize: tuple[float, float] | None = None,
    style: StyleName = "architect",
) -> Axes:
    """Draw a plan on an axis; ``FloorPlan.plot`` describes the parameters.

    Its parts have z-orders below 1, so that what is drawn on the axis later lies on top.
    """
    if ax is not None and figsize is not None:
        raise ConfigError("plot: expected ax or figsize, found both; figsize is the size of a new figure")
    ax = ax if ax is not None else _pyplot().subplots(figsize=figsize)[1]
    x1, y1, x2, y2 = plan.free_space.bounds
    margin = 0.02 * max(x2 - x1, y2 - y1) + (2 * wall_thickness if walls else 0.0)
    ax.set(xlim=(x1 - margin, x2 + margin), ylim=(y1 - margin, y2 + margin), aspect="equal")
    ax.set(xlabel="x (m)", ylabel="y (m)")
    box = ax.get_position()
    wide, high = (float(side) * _PIXELS_AN_INCH for side in ax.get_figure(root=True).get_size_inches())  # type: ignore[union-attr]  # an axis has a figure
    scale = min(box.width * wide / (x2 - x1 + 2 * margin), box.height * high / (y2 - y1 + 2 * margin))
    parts = Parts(rooms, labels and rooms, doors, objects, walls, wall_thickness)
    _add_scene(ax, lay_out_plan(plan, max(scale, FEWEST_CELLS / max(x2 - x1, y2 - y1)), 0, style, parts))
    if title is not None:
        ax.set_title(title)
    return ax


def plot_sheet(
    plans: Sequence[Any],
    *,
    columns: int,
    titles: Callable[[Any], str],
    size: float,
    figsize: tuple[float, float] | None = None,
    **options: Any,
) -> Figure:
    """Draw plans side by side, each on an axis without ticks; ``Dataset.plot`` describes the parameters."""
    rows = max(math.ceil(len(plans) / columns), 1)
    figure: Figure
    figure, axes = _pyplot().subplots(rows, columns, squeeze=False, figsize=figsize or (size * columns, size * rows))
    for ax in axes.flat:
        ax.set_axis_off()
    for plan, ax in zip(plans, axes.flat, strict=False):
        plot_plan(plan, ax, title=titles(plan), **options)
        ax.title.set_fontsize(8)
    figure.tight_layout()
    return figure


def _add_scene(ax: Axes, scene: Scene) -> None:
    """Add a plan to an axis in metres, without its scale bar and legend: the axis has ticks."""
    from matplotlib.collections import LineCollection
    from shapely.plotting import patch_from_polygon

    for area in scene.areas:
        if not area.shape.is_empty:
            ax.add_patch(patch_from_polygon(area.shape, facecolor=area.fill, edgecolor="none", linewidth=0, zorder=0.1))
    if scene.lines:
        points, colours, widths = zip(*((line.points, line.colour, line.width) for line in scene.lines), strict=True)
        pens = [_POINTS * width for width in widths]
        ax.add_collection(LineCollection(points, colors=colours, linewidths=pens, zorder=0.5), autolim=False)
    for words in scene.words:
        _add_words(ax, words, scene)


def _add_words(ax: Axes, words: TextLines, scene: Scene) -> None:
    """Write a room's name; when it is drawn, it is made to fit into its box, whatever the size of the axis then is."""
    from matplotlib.patheffects import withStroke
    from matplotlib.text import Text

    across, up = words.box_m(scene.pixels_per_metre)

    class FittedText(Text):
        def draw(self, renderer: Any, *args: Any, **kwargs: Any) -> None:
            (left, low), (right, high) = ax.transData.transform([(0, 0), (across, up)])
            self.set_fontsize(_POINTS * words.size)
            found = self.get_window_extent(renderer)
            fit = min(1.0, abs(right - left) / max(found.width, 1), abs(high - low) / max(found.height, 1))
            if fit * words.size < 0.75 * SMALLEST_PX:
                return
            self.set_fontsize(fit * _POINTS * words.size)
            super().draw(renderer, *args, **kwargs)

    text = FittedText(
        words.x, words.y, "\n".join(words.lines), fontsize=_POINTS * words.size, color=scene.style.ink,
        ha="center", va="center", linespacing=LINE, rotation=90 if words.turned else 0, zorder=0.6, clip_on=True,
    )  # fmt: skip
    if words.halo is not None:
        text.set_path_effects([withStroke(linewidth=0.3 * _POINTS * words.size, foreground=words.halo)])
    text.set_in_layout(False)
    ax.add_artist(text)


def _pyplot() -> Any:
    try:
        from matplotlib import pyplot
    except ImportError:
        raise MissingDependencyError("plot needs matplotlib: pip install matplotlib") from None
    return pyplot
