"""Maps that robots made, through a plan into other programs' formats, laid over the first map in its own frame.

ROSE2's maps and that of aws_small_house, most of which a robot made, get an origin and a yaw. Maps in which the ground
outside is free too are left out, since it is no part of the plan. Each is built, and its
plan is exported with the defaults. The files are read by the readers of ``tests/houseexpo/exports/readers.py``, which
use none of our code, and are compared with the free cells of the map (the largest connected piece): once with the cells
as they are, with the holes of furniture and what rays saw through windows, and once with the free space of the plan,
which the format alone may change. A second table compares the plans alone: built without ``--furniture`` and with it,
with all cells and with those inside the outline of the plan. ``PYTHONPATH=. pytest -s --benchmarks`` prints the table.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image
from rich.console import Console
from rich.table import Table
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo import FloorPlan, export
from houseexpo.grids.frame import source_points_from_plan
from pipeline.config import EvidenceConfig, PipelineConfig
from tests.builders.batch import plans_of
from tests.builders.shared import DATA, needs_shared
from tests.houseexpo.exports.readers import READERS

FORMATS = ("ros", "sdf", "stage", "irsim", "geojson", "rmf", "dxf", "svg", "glb")
CELL_M = 0.05
ORIGIN = (-10.4, 5.15)
YAW = 0.35
MARGIN_M = 2.0
"""So far around the map, what a file has beyond it counts against it."""


def maps(folder: Path) -> Iterator[tuple[str, Path, npt.NDArray[np.bool_]]]:
    """Yield the name of each map, its map.yaml, and its free cells (rows, cols), row 0 at the lowest y."""
    pictures = sorted(path for path in (DATA / "maps" / "rose").glob("*.png") if not path.stem.endswith("_truth"))
    for picture in [*pictures, DATA / "gazebo" / "aws_small_house" / "map.pgm"]:
        shades = np.asarray(Image.open(picture).convert("L"))
        name = picture.stem if picture.parent.name == "rose" else picture.parent.name
        Image.fromarray(shades).save(folder / f"{name}.png")
        lines = [f"image: {name}.png", f"resolution: {CELL_M}", f"origin: [{ORIGIN[0]}, {ORIGIN[1]}, {YAW}]"]
        lines += ["negate: 0", "occupied_thresh: 0.65", "free_thresh: 0.196"]
        (folder / f"{name}.yaml").write_text("\n".join(lines) + "\n")
        free = ((255 - shades.astype(float)) / 255 < 0.196)[::-1]
        _, pieces, stats, _ = cv2.connectedComponentsWithStats(free.view(np.uint8), connectivity=4)
        largest = pieces == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
        if not any(side.any() for side in (largest[0], largest[-1], largest[:, 0], largest[:, -1])):
            yield name, folder / f"{name}.yaml", largest


def points_of(cells: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]:
    """Return the middles (rows, cols, 2) of cells in the map's frame, metres."""
    cols, rows = np.meshgrid(np.arange(cells.shape[1]) + 0.5, np.arange(cells.shape[0]) + 0.5)
    cos, sin = np.cos(YAW) * CELL_M, np.sin(YAW) * CELL_M
    return np.stack([ORIGIN[0] + cos * cols - sin * rows, ORIGIN[1] + sin * cols + cos * rows], axis=-1)


def cells_in(shape: BaseGeometry, points: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Return which points (rows, cols, 2) lie in a shape."""
    shapely.prepare(shape)
    return np.asarray(shapely.contains_xy(shape, points[..., 0], points[..., 1]))


def free_in_source(plan: FloorPlan) -> BaseGeometry:
    """Return the free space of a plan in the map's frame."""
    found: BaseGeometry = shapely.transform(plan.free_space, lambda p: source_points_from_plan(plan.frame, p))
    return found


def iou(one: npt.NDArray[np.bool_], other: npt.NDArray[np.bool_]) -> float:
    """Return intersection over union of cells."""
    return float((one & other).sum() / (one | other).sum())


@needs_shared
def test_real_maps_come_back_in_their_own_frame(tmp_path: Path) -> None:
    scores: dict[str, list[tuple[float, float]]] = {form: [] for form in FORMATS}
    plans: dict[bool, list[tuple[float, float]]] = {False: [], True: []}
    console, count = Console(width=120), 0
    for name, path, free in maps(tmp_path):
        plan = max(plans_of(path), key=lambda each: each.area)
        pad = round(MARGIN_M / CELL_M)
        cells = np.pad(free, pad)
        points = points_of(cells) - pad * CELL_M * np.array(
            [np.cos(YAW) - np.sin(YAW), np.sin(YAW) + np.cos(YAW)]
        )  # the corner of the margin
        said = cells_in(free_in_source(plan), points)
        for furniture, rows in plans.items():
            built = PipelineConfig(evidence=EvidenceConfig(furniture=furniture))
            space = free_in_source(max(plans_of(path, built), key=lambda each: each.area))
            inside = cells_in(shapely.union_all([Polygon(part.exterior) for part in shapely.get_parts(space)]), points)
            floor = cells_in(space, points)
            rows.append((iou(floor, cells), iou(floor, cells & inside)))
        for form in FORMATS:
            out = tmp_path / name / form
            files = {file.name: file.read_bytes() for file in export(plan, form, out)}
            found = cells_in(READERS[form](files), points)
            scores[form].append((iou(found, cells), iou(found, said)))
        count += 1
        worst = min(rows[-1][1] for rows in scores.values())
        console.print(
            f"{name}: {len(plan.rooms)} rooms, plan with the free cells {iou(said, cells):.3f}, formats {worst:.3f}"
        )

    table = Table(title=f"IoU in the map's own frame (origin {ORIGIN}, yaw {YAW}), {count} maps that robots made")
    for heading in ("format", "with the robot's free cells: median", "least", "with the plan: median", "least"):
        table.add_column(heading, justify="right" if heading != "format" else "left")
    for form, rows in scores.items():
        cells_iou, plan_iou = np.array(rows).T
        values = (np.median(cells_iou), cells_iou.min(), np.median(plan_iou), plan_iou.min())
        table.add_row(form, *(f"{value:.3f}" for value in values))
    console.print(table)

    table = Table(title="IoU of plans with the robot's free cells: median, least")
    for heading in ("--furniture", "all cells", "cells inside the plan's outline"):
        table.add_column(heading)
    for furniture, pairs in plans.items():
        found = np.array(pairs)
        cells_iou = (f"{np.median(column):.3f}, {column.min():.3f}" for column in found.T)
        table.add_row("yes" if furniture else "no", *cells_iou)
    console.print(table)
    assert min(plan_iou for rows in scores.values() for _, plan_iou in rows) > 0.9
