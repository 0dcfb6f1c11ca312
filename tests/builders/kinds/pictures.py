"""Pictures of storeys for people: the truth, and a plan beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon as Patch

COLOURS = {"door": "b", "opening": "c", "entrance": "m", "cut": "r"}


def draw_truth(axes: Axes, truth: dict[str, Any]) -> None:
    """Rooms with labels, inner doors blue, others magenta."""
    for room in truth["rooms"]:
        axes.add_patch(Patch(np.array(room["polygon"]), fc="#cfe8cf", ec="k", lw=0.6))
        axes.text(*np.mean(room["polygon"], axis=0), str(room["label"]), fontsize=6, ha="center")
    for door in truth["doors"]:
        axes.plot(*line(door).T, c="b" if door["interior"] else "m", lw=3)


def line(door: dict[str, Any]) -> np.ndarray:
    """A door's ends."""
    half = np.array(door["direction"], float) * door["width"] / 2
    return np.array([np.array(door["centre"]) - half, np.array(door["centre"]) + half])


def draw_plan(axes: Axes, plan: dict[str, Any]) -> None:
    """A plan in the source's metres; cuts are red."""
    matrix = np.asarray(plan["frame"]["matrix"], float)

    def placed(points: Any) -> np.ndarray:
        return np.asarray(points, float) @ matrix[:, :2].T + matrix[:, 2]

    axes.add_patch(Patch(placed(plan["verts"]), fc="#eeeeee", ec="k", lw=1))
    for hole in plan.get("holes", []):
        axes.add_patch(Patch(placed(hole), fc="#888888", ec="k", lw=0.5))
    for number, room in enumerate(plan["rooms"]):
        axes.add_patch(Patch(placed(room["polygon"]), fc=plt.cm.tab20(number % 20), alpha=0.5, ec="k", lw=0.6))
        axes.text(*placed(room["polygon"]).mean(axis=0), room["label"], fontsize=6, ha="center")
    for door in plan["doors"]:
        axes.plot(*placed(door["segment"]).T, c=COLOURS[door["kind"]], lw=4, alpha=0.8)


def overlay(path: Path, truths: list[dict[str, Any]], plans: list[dict[str, Any]], title: str = "") -> None:
    """Write a PNG: on the left what is true, on the right what was found, level by level."""
    rows = max(1, len(truths), len(plans))
    figure, axes = plt.subplots(rows, 2, figsize=(15, 7 * rows), squeeze=False)
    for row in range(rows):
        if row < len(truths):
            draw_truth(axes[row, 0], truths[row])
            for door in truths[row]["doors"]:
                axes[row, 1].plot(*line(door).T, c="k", lw=1, zorder=9)
        if row < len(plans):
            draw_plan(axes[row, 1], plans[row])
        for one in axes[row]:
            one.set_aspect("equal")
            one.autoscale_view()
    figure.suptitle(title, fontsize=8)
    figure.savefig(path, dpi=60, bbox_inches="tight")
    plt.close(figure)
