"""What a robot saw to stand in a room is an obstacle of the plan, if the build asks for furniture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shapely
from PIL import Image, ImageDraw

from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from pipeline.config import EvidenceConfig, PipelineConfig
from pipeline.sources import find, reader
from pipeline.sources.occupancy_map.clutter import things_in_rooms
from tests.builders.houses import plan_of

CELL_M = 0.05
SEEN, UNSEEN, FREE = 0, 205, 254
TABLE, CUPBOARD, STRIP = (60, 60, 83, 75), (11, 110, 40, 125), (120, 11, 150, 11)
"""Corners in pixels: a table of 1.2 x 0.8 m, a cupboard at a wall of which the front was seen, a bulge of the wall."""


def hall() -> Image.Image:
    """A hall of 11 x 8 m with these things."""
    picture = Image.new("L", (240, 180), UNSEEN)
    draw = ImageDraw.Draw(picture)
    draw.rectangle((8, 8, 231, 171), fill=SEEN)
    draw.rectangle((11, 11, 228, 168), fill=FREE)
    draw.rectangle(TABLE, fill=SEEN)
    draw.rectangle(CUPBOARD, fill=SEEN)
    draw.rectangle((CUPBOARD[0], CUPBOARD[1] + 2, CUPBOARD[2] - 2, CUPBOARD[3] - 2), fill=UNSEEN)
    draw.rectangle(STRIP, fill=SEEN)
    return picture


def built(folder: Path, furniture: bool, more: str = "") -> FloorPlan:
    hall().save(folder / "map.png")
    lines = [f"image: map.png\nresolution: {CELL_M}\norigin: [2, -1, 0.3]", "negate: 0", "occupied_thresh: 0.65"]
    (folder / "map.yaml").write_text("\n".join([*lines, "free_thresh: 0.196", more]) + "\n")
    (item,) = find(str(folder / "map.yaml"))
    (level,) = reader(item.reader).read(item)
    return plan_of(level, PipelineConfig(evidence=EvidenceConfig(furniture=furniture)))


def overlap(plan: FloorPlan) -> float:
    """Intersection over union of the map's free cells and the plan's free space, in the map's frame."""
    rows, cols = np.nonzero(np.array(hall())[::-1] == FREE)
    cos, sin = np.cos(0.3) * CELL_M, np.sin(0.3) * CELL_M
    ring = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    corners = np.stack([cols, rows], axis=-1)[:, None] + ring
    placed = np.array([2, -1]) + corners @ np.array([[cos, sin], [-sin, cos]])
    cells = shapely.union_all(shapely.polygons(placed))
    ours = shapely.transform(plan.free_space, lambda points: source_points_from_plan(plan.frame, points))
    return float(cells.intersection(ours).area / cells.union(ours).area)


def test_with_furniture_a_plan_has_what_was_seen_in_its_room(tmp_path: Path) -> None:
    plan = built(tmp_path, furniture=True)
    sizes = sorted(thing.polygon.area for thing in plan.objects)
    assert sizes == pytest.approx([24 * 16 * CELL_M**2, 30 * 16 * CELL_M**2], rel=0.1)
    assert overlap(plan) > 0.99


def test_without_furniture_its_floor_is_whole_and_its_quality_the_same(tmp_path: Path) -> None:
    bare, furnished = built(tmp_path, furniture=False), built(tmp_path, furniture=True)
    assert not bare.objects
    assert overlap(bare) < 0.985
    assert bare.quality == furnished.quality


def test_in_a_drawing_all_that_is_not_free_is_wall(tmp_path: Path) -> None:
    assert not built(tmp_path, furniture=True, more="walls_only: true").objects


@pytest.mark.parametrize("turns", range(4))
def test_things_turn_with_their_map(turns: int) -> None:
    picture = np.array(hall())
    rooms = np.zeros(picture.shape, bool)
    rooms[11:169, 11:229] = True
    cells = [rooms, picture == FREE, picture == SEEN]
    found = things_in_rooms(*cells, CELL_M)
    turned = things_in_rooms(*(np.ascontiguousarray(np.rot90(each, turns)) for each in cells), CELL_M)
    assert np.array_equal(np.rot90(found, turns), turned)
    assert found[60:76, 60:84].all()
    assert found[110:126, 11:41].all()
    assert found.sum() == 24 * 16 + 30 * 16
