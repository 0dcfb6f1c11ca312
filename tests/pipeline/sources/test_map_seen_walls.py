"""Walls that a robot saw inside a room stay in its plan, and gaps to what it did not see are entrances."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from PIL import Image, ImageDraw

from houseexpo import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from pipeline.sources.occupancy_map.seen_walls import SeenSides, entrance_gaps
from tests.builders.batch import plans_of
from tests.builders.tries import slow_but

CELL_M = 0.05
WIDE, HIGH = 500, 240
"""A hall of 24 x 11 m, in cells of a picture of 25 x 12 m."""


def hall() -> Image.Image:
    picture = Image.new("L", (WIDE, HIGH), 205)
    ImageDraw.Draw(picture).rectangle((7, 7, WIDE - 8, HIGH - 8), fill=0)
    ImageDraw.Draw(picture).rectangle((10, 10, WIDE - 11, HIGH - 11), fill=254)
    return picture


def wall(
    picture: Image.Image, start: tuple[float, float], length_m: float, thick_m: float, turn: float
) -> shapely.Polygon:
    """Draw a wall from a point, metres from the lower-left corner, and return its shape."""
    way = np.array([math.cos(turn), math.sin(turn)])
    across = np.array([-way[1], way[0]]) * thick_m / 2
    a, b = np.array(start), np.array(start) + way * length_m
    shape = shapely.Polygon([a - across, b - across, b + across, a + across])
    cols, rows = np.meshgrid(np.arange(WIDE), np.arange(HIGH))
    inside = shapely.contains_xy(shape, (cols + 0.5) * CELL_M, (HIGH - rows - 0.5) * CELL_M)
    cells = np.array(picture)
    cells[inside] = 0
    picture.paste(Image.fromarray(cells))
    return shape


def built(picture: Image.Image, folder: Path) -> tuple[FloorPlan, shapely.Geometry]:
    """Return the plan of a map, and its free space in metres from the picture's lower-left corner."""
    picture.save(folder / "map.png")
    thresholds = "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    (folder / "map.yaml").write_text(f"image: map.png\nresolution: {CELL_M}\norigin: [0, 0, 0]\n{thresholds}")
    (plan,) = plans_of(folder / "map.yaml")
    return plan, shapely.transform(plan.free_space, lambda p: source_points_from_plan(plan.frame, p))


@pytest.mark.parametrize("turn", [0.0, 0.4], ids=["straight", "oblique"])
@pytest.mark.parametrize("thick_m", slow_but([0.1, 0.2, 0.4], 0.1, 0.4))
@pytest.mark.parametrize("length_m", slow_but([1.8, 6.0, 12.6, 19.2], 1.8, 6.0))
def test_a_wall_that_hangs_at_one_end_is_a_slit(length_m: float, thick_m: float, turn: float, tmp_path: Path) -> None:
    picture = hall()
    drawn = wall(picture, (0.4, 2.0), length_m, thick_m, turn)
    if drawn.bounds[3] > 11.0:
        pytest.skip("it does not fit in the hall")
    _, space = built(picture, tmp_path)
    assert shapely.intersection(space, drawn).area < 0.2 * drawn.area
    assert space.exterior.distance(drawn.centroid) < thick_m + 0.1  # no hole: it hangs
    assert not space.interiors


@pytest.mark.parametrize("thick_m", slow_but([0.1, 0.25, 0.4], 0.1, 0.4))
@pytest.mark.parametrize("length_m", slow_but([2.0, 6.0, 12.6], 2.0, 12.6))
def test_a_wall_that_stands_free_is_a_hole(length_m: float, thick_m: float, tmp_path: Path) -> None:
    picture = hall()
    drawn = wall(picture, (4.0, 6.0), length_m, thick_m, 0.0)
    _, space = built(picture, tmp_path)
    (hole,) = (shapely.Polygon(ring) for ring in space.interiors)
    assert shapely.intersection(hole, drawn).area > 0.8 * drawn.area
    assert hole.area < drawn.area + 0.2 * length_m


def test_clutter_stays_clutter(tmp_path: Path) -> None:
    """A short line and a cupboard of 1.2 x 0.8 m are furniture, a wedge that was not seen is no wall."""
    picture = hall()
    wall(picture, (4.0, 6.0), 1.2, 0.1, 0.0)
    wall(picture, (9.0, 6.0), 1.2, 0.8, 0.0)
    ImageDraw.Draw(picture).line((300, 60, 360, 64), fill=205, width=2)
    _, space = built(picture, tmp_path)
    assert not space.interiors
    assert space.area == pytest.approx(24.0 * 11.0, rel=0.02)


def test_a_short_piece_in_line_with_a_wall_is_wall(tmp_path: Path) -> None:
    picture = hall()
    cells = np.array(picture)
    cells[7:100, 300:WIDE] = 205  # the hall is an L
    cells[7:100, 297:300] = 0
    cells[97:100, 297 : WIDE - 7] = 0
    picture = Image.fromarray(cells)
    drawn = wall(picture, (297.5 * CELL_M + 0.05, (HIGH - 122) * CELL_M), 1.1, 0.15, math.pi / 2)
    _, space = built(picture, tmp_path)
    assert shapely.intersection(space, drawn).area < 0.3 * drawn.area


def gap(picture: Image.Image, width_m: float, shade: int = 205) -> npt.NDArray[np.uint8]:
    cells = np.array(picture)
    cells[100 : 100 + round(width_m / CELL_M), WIDE - 10 :] = 205
    cells[100 : 100 + round(width_m / CELL_M), WIDE - 10 : WIDE - 7] = shade
    return cells


@pytest.mark.parametrize("shade", [205, 254], ids=["unseen", "free"])
@pytest.mark.parametrize(("width_m", "kinds"), [(0.3, []), (0.8, ["entrance"]), (1.3, ["entrance"]), (2.5, [])])
def test_a_gap_to_what_was_not_seen_is_an_entrance(
    width_m: float, kinds: list[str], shade: int, tmp_path: Path
) -> None:
    plan, _ = built(Image.fromarray(gap(hall(), width_m, shade)), tmp_path)
    assert [door.kind for door in plan.doors] == kinds
    if kinds:
        assert plan.doors[0].width == pytest.approx(width_m, abs=0.15)
        place = source_points_from_plan(plan.frame, np.mean(plan.doors[0].segment, axis=0))
        assert place == pytest.approx([24.6, (HIGH - 100) * CELL_M - width_m / 2], abs=0.25)  # somewhere in the wall


@pytest.mark.parametrize("crop", [7, 10], ids=["at the wall's back", "at its face"])
def test_a_gap_at_the_pictures_border_is_an_entrance(crop: int, tmp_path: Path) -> None:
    cells = gap(hall(), 1.0, 254)[:, : WIDE - crop]
    cells[:100, WIDE - crop - 1 :] = 0
    cells[120:, WIDE - crop - 1 :] = 0
    plan, _ = built(Image.fromarray(cells), tmp_path)
    assert [door.kind for door in plan.doors] == ["entrance"]


@pytest.mark.parametrize("corners", [3, 4, 5])
def test_a_closet_with_few_corners_has_no_recess(corners: int) -> None:
    room = shapely.Polygon([(1, 1), (2, 1), (2, 3), (1.5, 3.5), (1, 3)][:corners])
    free, occupied = np.zeros((100, 100), np.bool_), np.ones((100, 100), np.bool_)
    assert entrance_gaps(room, [], SeenSides(free, occupied, CELL_M)) == []


def test_a_byte_order_mark_hides_no_map(tmp_path: Path) -> None:
    hall().save(tmp_path / "m.pgm")
    text = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n"
    (tmp_path / "m.yaml").write_text(text, encoding="utf-8-sig")
    assert len(plans_of(tmp_path / "m.yaml")) == 1
