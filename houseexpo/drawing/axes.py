"""Draw plans on matplotlib axes, for notebooks and papers, in the same colours as in other pictures."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from houseexpo.drawing.scene import DOOR_COLOURS, FLOOR, FURNITURE, FURNITURE_EDGE, INK, WALL
from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.plan.room_labels import label_colour

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from shapely.geometry.base import BaseGeometry

    from houseexpo.plan.model import PlanData


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
) -> Axes:
    """Draw a plan on an axis; ``FloorPlan.plot`` describes the parameters.

    Its parts have z-orders below 1, so that what is drawn on the axis later lies on top.
    """
    if ax is not None and figsize is not None:
        raise ConfigError("plot: expected ax or figsize, found both; figsize is the size of a new figure")
    ax = ax if ax is not None else _pyplot().subplots(figsize=figsize)[1]
    if walls:
        around = plan.outline.buffer(2 * wall_thickness, join_style="mitre").buffer(-wall_thickness, join_style="mitre")
        _fill(ax, around, WALL, zorder=0.1)
    _fill(ax, plan.free_space, FLOOR, zorder=0.2)
    for room in plan.rooms if rooms else ():
        _fill(ax, room.polygon, label_colour(room.label), zorder=0.3)
    for thing in plan.objects if objects else ():
        _fill(ax, thing.polygon, FURNITURE, edge=FURNITURE_EDGE, zorder=0.4)
    for door in plan.doors if doors else ():
        (x1, y1), (x2, y2) = door.segment
        ax.plot([x1, x2], [y1, y2], color=DOOR_COLOURS[door.kind], linewidth=2.5, solid_capstyle="butt", zorder=0.5)
    for room in plan.rooms if rooms and labels else ():
        x, y = room.polygon.representative_point().coords[0]
        ax.text(x, y, room.label.replace("_", " "), ha="center", va="center", fontsize=7, color=INK, zorder=0.6)
    x1, y1, x2, y2 = plan.outline.bounds
    margin = 0.02 * max(x2 - x1, y2 - y1) + (2 * wall_thickness if walls else 0.0)
    ax.set(xlim=(x1 - margin, x2 + margin), ylim=(y1 - margin, y2 + margin), aspect="equal")
    ax.set(xlabel="x (m)", ylabel="y (m)")
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


def _fill(ax: Axes, shape: BaseGeometry, face: str, *, zorder: float, edge: str = "none") -> None:
    from shapely.plotting import patch_from_polygon

    if not shape.is_empty:
        ax.add_patch(patch_from_polygon(shape, facecolor=face, edgecolor=edge, linewidth=0.5, zorder=zorder))


def _pyplot() -> Any:
    try:
        from matplotlib import pyplot
    except ImportError:
        raise MissingDependencyError("plot needs matplotlib: pip install matplotlib") from None
    return pyplot
