"""Draw the pictures of ``docs/algorithm.md`` and ``docs/guide-homes.md``: ``make pictures``.

Three of the houses of ``procedural:60?style=test --seed 2019``: one in which a wall is cut, one with a chimney, one
with a garage that stands apart.
"""

from __future__ import annotations

import shutil
import tempfile
from itertools import islice
from pathlib import Path

import numpy as np
from PIL import Image

from houseexpo.drawing.draw import contact_sheet, draw_plan
from pipeline.algorithm import plan_house
from pipeline.config import PipelineConfig
from pipeline.config_file import BuildConfig, BuildOptions
from pipeline.inspection import inspect_house
from pipeline.sources import find, reader

HOMES, N_HOMES = Path(__file__).parent / "images" / "homes.png", 24
FOLDER = Path(__file__).parent / "images" / "stages"
CONFIG = BuildConfig(BuildOptions(sources=("procedural:60?style=test",), seed=2019))
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
        with tempfile.TemporaryDirectory() as drawn:
            inspect_house(CONFIG, {}, 0, Path(drawn), name)
            for stage in stages:
                (picture,) = Path(drawn).glob(f"[0-9][0-9]_{stage}.png")
                files.append(folder / f"{stage}.png")
                shutil.copyfile(picture, files[-1])
    return files


def draw_homes(file: Path = HOMES) -> None:
    """Write a contact sheet of the first homes of seed 1."""
    items = islice(find("procedural:1000", seed="1"), N_HOMES)
    levels = [level for item in items for level in reader(item.reader).read(item)]
    plans = [plan_house(level, PipelineConfig(), np.random.default_rng(0)) for level in levels]
    captions = [f"{plan.room_num} rooms, {plan.area:.0f} m2" for plan in plans]
    Image.fromarray(contact_sheet([draw_plan(plan, size=200) for plan in plans], 6, captions)).save(file, optimize=True)


if __name__ == "__main__":
    draw()
    draw_homes()
