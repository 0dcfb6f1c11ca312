"""Journey 1: a robot's map -> plan -> maps and worlds of other programs, laid over the first map in its own frame.

The commands are those of docs/readers/robotics.md, "A map of your own". The map is drawn here, and read back by
NumPy and by the readers of ``tests/houseexpo/exports/readers.py``, which use none of our code.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from PIL import Image
from shapely.geometry.base import BaseGeometry

from houseexpo import open_dataset
from tests.builders.commands import call
from tests.houseexpo.exports.readers import READERS, of_cells
from tests.journeys.pages import blocks

PAGE = "docs/readers/robotics.md"
CELL_M = 0.05
GOAL = (9.5, 1.2)
"""In metres from the picture's lower-left corner: in the room at the lower right."""
FORMATS = {form: f"mine_{form}" for form in ("ros", "sdf", "stage", "irsim", "geojson", "rmf")}
"""The formats of the page, and the folders that it writes them to."""


def draw_flat() -> npt.NDArray[np.uint8]:
    """Return a map of four rooms round a hall, as map_saver draws one: 254 free, 0 occupied, 205 unknown."""
    cells = np.full((200, 260), 205, np.uint8)
    cells[20:180, 20:240] = 0
    for rows, cols in (
        (slice(22, 86), slice(22, 98)),
        (slice(22, 86), slice(100, 238)),
        (slice(88, 118), slice(22, 238)),
        (slice(120, 178), slice(22, 150)),
        (slice(120, 178), slice(152, 238)),
    ):
        cells[rows, cols] = 254
    for rows, cols in (
        (slice(86, 88), slice(50, 68)),
        (slice(86, 88), slice(160, 178)),
        (slice(118, 120), slice(80, 98)),
        (slice(118, 120), slice(190, 208)),
    ):
        cells[rows, cols] = 254
    return cells


KINDS = {
    "pgm": ("map.pgm", "negate: 0", "[-10, -5, 0]"),
    "turned-png-negate": ("map.png", "negate: 1", "[-10.0, -5.0, 0.35]"),
    "turned-left": ("map.pgm", "mode: trinary\nnegate: 0", "[3.0, 40.0, -2.2]"),
    "nan": ("map.png", "negate: 0", "[-10.0, -5.0, -nan]"),
}
"""The picture, how it is understood, and the origin."""


def save_map(folder: Path, kind: str) -> tuple[float, float, float]:
    """Write map.yaml and its picture, and return x, y and yaw of its origin."""
    picture, negate, origin = KINDS[kind]
    cells = draw_flat()
    Image.fromarray(255 - cells if "negate: 1" in negate else cells).save(folder / picture)
    thresholds = "occupied_thresh: 0.65\nfree_thresh: 0.196"
    text = f"image: {picture}\nresolution: {CELL_M}\norigin: {origin}\n{negate}\n{thresholds}\n"
    (folder / "map.yaml").write_text(text)
    x, y, yaw = (float(word) for word in origin.strip("[]").split(","))
    return x, y, 0.0 if math.isnan(yaw) else yaw


def commands() -> Iterator[list[str]]:
    """Yield the commands of the page that end by themselves, without ``houseexpo``."""
    (lines,) = (block for block in blocks(PAGE, "text") if "build map.yaml" in block)
    for line in lines.splitlines():
        words = shlex.split(line, comments=True)[1:]
        if words[0] in {"build", "show", "export"}:
            yield words


def iou(one: BaseGeometry, other: BaseGeometry) -> float:
    """Return intersection over union."""
    return float(shapely.intersection(one, other).area / shapely.union(one, other).area)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_robots_map_comes_back_from_every_format_in_its_own_frame(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    x, y, yaw = save_map(tmp_path, kind)
    for words in commands():
        done = call(*words)
        if words[0] == "export":
            assert "in the frame of the source" in " ".join(done.split())

    (plan,) = open_dataset("plans/mine")
    assert len(plan.rooms) == 5
    assert ("yaw" in plan.provenance) == (kind == "nan")

    seen = of_cells(draw_flat()[::-1] == 254, (x, y), yaw, CELL_M)
    cos, sin = math.cos(yaw), math.sin(yaw)
    goal = shapely.Point(x + cos * GOAL[0] - sin * GOAL[1], y + sin * GOAL[0] + cos * GOAL[1])
    assert seen.contains(goal)
    to_wall_m = seen.exterior.distance(goal)
    for form, folder in FORMATS.items():
        files = {path.name: path.read_bytes() for path in (tmp_path / folder).iterdir() if path.name != ".houseexpo"}
        found = READERS[form](files)
        assert iou(seen, found) >= 0.95, form
        assert found.contains(goal), form
        assert found.boundary.distance(goal) == pytest.approx(to_wall_m, abs=0.1), form


def test_the_page_writes_the_formats_of_the_journey() -> None:
    said = {words[words.index("--to") + 1]: words[words.index("--out") + 1] for words in commands() if "--to" in words}
    assert said == FORMATS
