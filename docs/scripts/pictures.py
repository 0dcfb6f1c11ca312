"""Draw the pictures of ``docs/algorithm.md``, ``docs/guide-homes.md`` and ``docs/readers``: ``make pictures``.

Three of the first 60 houses that the tests make with seed 2019: one in which a wall is cut, one with a shaft, one
with a garage that stands apart. The pages for readers show one home of the demo data set.
"""

from __future__ import annotations

import shutil
import tempfile
from itertools import islice
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Rectangle
from PIL import Image

import houseexpo
from houseexpo.drawing.draw import contact_sheet, draw_plan
from pipeline.algorithm import plan_largest_building, run_stages
from pipeline.config import PipelineConfig
from pipeline.config_file import BuildConfig, BuildOptions
from pipeline.inspection import inspect_house
from pipeline.pictures import WORDS_PX, stage_pictures
from pipeline.sources import find, reader
from tests.builders.suncg_houses import scene_id, write_house

IMAGES = Path(__file__).parents[1] / "images"
EXAMPLE = Path(__file__).parents[2] / "pipeline" / "examples" / "house.ifc"
STAGES = {
    "evidence": "1  walls, doors, railing, floor",
    "door plane": "2  door plane: the doors are open",
    "ground plane": "3  ground plane: the doors are closed",
    "layout": "4  closed rooms",
    "contour": "5  doors, entrances, contour",
    "plan": "6  the plan",
}
"""Stages of the sheet, and their titles."""
HOMES, N_HOMES = IMAGES / "homes.png", 24
SHOWN = "256c93cfa6434e7e25d07419ec01bea2"
"""The made home that the pages for readers show."""
FOLDER = IMAGES / "stages"
SEED = 2019
HOUSES = {
    "b16a83220d643acf43c072de5df74a54": (
        *("door_plane", "ground_plane", "layout", "doors", "contour", "connectivity", "refine", "plan"),
    ),
    "78267747cf2a671fe3cf46ed3ffa4503": ("cells",),
    "08866abf5a2af938a1f9ab5917b91f33": ("isolated",),
}
"""Ids, and the stages of which each house is the picture."""


def draw(folder: Path = FOLDER) -> list[Path]:
    """Write a picture of each stage, named as the stage; return their files."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for name, stages in HOUSES.items():
        with tempfile.TemporaryDirectory() as root, tempfile.TemporaryDirectory() as drawn:
            (index,) = (index for index in range(60) if scene_id(index, SEED) == name)
            write_house(Path(root), index, SEED)
            config = BuildConfig(BuildOptions(sources=(root,), seed=SEED))
            inspect_house(config, {}, 0, Path(drawn), name)
            for stage in stages:
                (picture,) = Path(drawn).glob(f"[0-9][0-9]_{stage}.png")
                files.append(folder / f"{stage}.png")
                shutil.copyfile(picture, files[-1])
                _shrink(files[-1])
    return files


def _shrink(file: Path) -> None:
    """Write a picture again with 256 colours: a drawing has few more, and the file is half as large."""
    with Image.open(file) as picture:
        small = picture.convert("RGB").quantize(256, dither=Image.Dither.NONE)
    small.save(file, optimize=True)


def draw_stages(file: Path = IMAGES / "stages.png") -> None:
    """Write six stages of the example house on one sheet, with titles that can be read on a page 830 pixels wide."""
    (item,) = find(str(EXAMPLE))
    (level,) = reader(item.reader).read(item)
    results = list(run_stages(level, PipelineConfig(), np.random.default_rng(0)))
    pictures = {name: drawn[:-WORDS_PX] for name, drawn in stage_pictures(results, level.frame)}
    pictures["plan"] = draw_plan(results[-1].value, size=pictures["doors"].shape[0])
    figure, axes = plt.subplots(2, 3, figsize=(8.3, 4.4), layout="constrained")
    for axis, (stage, title) in zip(axes.flat, STAGES.items(), strict=True):
        axis.imshow(pictures[stage])
        axis.set_title(title, fontsize=10)
        axis.set_axis_off()
    figure.savefig(file, dpi=200)
    _shrink(file)


def draw_homes(file: Path = HOMES) -> None:
    """Write a contact sheet of the storeys of the first homes of seed 1."""
    items = find("procedural:1000", seed="1")
    levels = islice((level for item in items for level in reader(item.reader).read(item)), N_HOMES)
    plans = [plan_largest_building(level, PipelineConfig(), np.random.default_rng(0)) for level in levels]
    captions = [_caption(plan) for plan in plans]
    Image.fromarray(contact_sheet([draw_plan(plan, size=200) for plan in plans], 6, captions)).save(file)
    _shrink(file)


def _caption(plan: houseexpo.FloorPlan) -> str:
    """Return the kind of a home, the storey of a house of several, and the area."""
    name = str((plan.provenance or {})["kind"])
    if plan.frame is not None and "_L" in plan.id:
        name += f", storey {plan.frame.level}"
    return f"{name}, {plan.area:.0f} m2"


def draw_readers(folder: Path = IMAGES) -> None:
    """Write a home beside its ROS map, its grids, and the rooms that are found in its published form."""
    (item,) = (item for item in find("procedural:300", seed="2019") if item.id == SHOWN)
    (level,) = reader(item.reader).read(item)
    plan = plan_largest_building(level, PipelineConfig(), np.random.default_rng(0))
    with tempfile.TemporaryDirectory() as made:
        ros = houseexpo.export([plan], "ros", Path(made) / "ros")
        (published,) = houseexpo.export([plan], "json", Path(made) / "json")
        ros_map = np.asarray(Image.open(next(file for file in ros if file.suffix == ".pgm")))
        bare = houseexpo.load_plan(published)
    grey, none = "gray", {"left": False, "bottom": False, "labelleft": False, "labelbottom": False}

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained")
    plan.plot(left, title="the plan")
    right.imshow(ros_map, cmap=grey, vmin=0, vmax=255)
    right.set_title("its ROS map")
    right.tick_params(**none)
    figure.savefig(folder / "reader_robotics.png", dpi=90)
    _shrink(folder / "reader_robotics.png")

    figure, axes = plt.subplots(1, 4, figsize=(12, 3.2), layout="constrained")
    rooms = np.ma.masked_less(plan.room_grid(), 0)
    axes[0].imshow(plan.grid(), origin="lower", cmap="gray_r")
    axes[1].imshow(rooms, origin="lower", cmap="tab10")
    axes[2].imshow(plan.distance_field(), origin="lower")
    plan.plot(axes[3], labels=False)
    graph = plan.graph()
    for one, other in graph.edges():
        ends = [graph.nodes[room]["position"] for room in (one, other)]
        axes[3].plot(*zip(*ends, strict=True), "o-", color="black", zorder=9)
    for axis, title in zip(axes, ("grid", "room_grid", "distance_field", "graph"), strict=True):
        axis.set(title=title, xlabel="", ylabel="")
        axis.tick_params(**none)
    figure.savefig(folder / "reader_learning.png", dpi=90)
    _shrink(folder / "reader_learning.png")

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4.2), layout="constrained")
    bare.plot(left, rooms=False, labels=False, doors=False, title="as published: an outline and labelled boxes")
    for label, boxes in bare.room_category.items():
        for x1, y1, x2, y2 in boxes:
            left.add_patch(Rectangle((x1, y1), x2 - x1, y2 - y1, fill=False, linestyle=":", zorder=9))
            left.annotate(label.replace("_", " "), ((x1 + x2) / 2, (y1 + y2) / 2), ha="center", fontsize=8, zorder=9)
    houseexpo.with_rooms(bare).plot(right, title="with_rooms: rooms and doors")
    figure.savefig(folder / "reader_archive.png", dpi=90)
    _shrink(folder / "reader_archive.png")


if __name__ == "__main__":
    draw()
    draw_stages()
    draw_homes()
    draw_readers()
