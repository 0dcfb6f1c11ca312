"""What the cells of a map say against its plan, on maps that are drawn by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from shapely import Polygon, box

from pipeline.quality import MAP_WHOLE, is_of_map, main_grounds_in_words, score_quality
from pipeline.sources.occupancy_map import signs
from pipeline.sources.occupancy_map.signs import measure_signs
from tests.builders.batch import plans_of

CELL_M = 0.05
FREE, WALL, UNSEEN = 254, 0, 205


def drawn(high: int = 200, wide: int = 200) -> np.ndarray:
    return np.full((high, wide), UNSEEN, np.uint8)


def room(shades: np.ndarray, left: float, bottom: float, right: float, top: float) -> Polygon:
    """Draw a room with a wall of two cells all around, metres from the lower-left corner, and return its inside."""
    x1, y1, x2, y2 = (round(value / CELL_M) for value in (left, bottom, right, top))
    rows = len(shades)
    shades[rows - y2 - 2 : rows - y1 + 2, x1 - 2 : x2 + 2] = WALL
    shades[rows - y2 : rows - y1, x1:x2] = FREE
    return box(left, bottom, right, top)


def fill(shades: np.ndarray, left: float, bottom: float, right: float, top: float, shade: int) -> None:
    x1, y1, x2, y2 = (round(value / CELL_M) for value in (left, bottom, right, top))
    shades[len(shades) - y2 : len(shades) - y1, x1:x2] = shade


def measured(shades: np.ndarray, rooms: list[Polygon], doorways: list[Polygon] | None = None) -> dict[str, float]:
    return measure_signs(shades == FREE, shades == WALL, CELL_M, rooms, doorways or [])


def test_nothing_speaks_against_rooms_all_of_whose_walls_were_seen() -> None:
    shades = drawn()
    rooms = [room(shades, 1, 1, 4, 4), room(shades, 4.1, 1, 8, 4)]
    fill(shades, 4, 2, 4.1, 3, FREE)
    assert measured(shades, rooms, [box(4, 2, 4.1, 3)]) == dict.fromkeys(measured(shades, rooms), 0.0)


def test_a_room_that_ends_where_nothing_was_seen_is_half_seen() -> None:
    shades = drawn()
    rooms = [room(shades, 1, 1, 4, 4), room(shades, 5, 1, 8, 4)]
    fill(shades, 8, 0.5, 8.5, 4.5, UNSEEN)  # a quarter of the edge of one of two rooms
    assert measured(shades, rooms)["half_seen_rooms"] == 0.5
    assert measured(shades, rooms, [box(8, 1, 8.1, 4)])["half_seen_rooms"] == 0.0  # a way is no edge


def test_free_cells_in_no_room_lie_beyond_the_plan() -> None:
    shades = drawn()
    rooms = [room(shades, 1, 1, 4, 4)]
    fill(shades, 5, 1, 6, 4, FREE)  # 3 m2 beside 9 m2
    assert measured(shades, rooms)["beyond_rooms"] == pytest.approx(0.25, abs=0.01)


def test_walls_far_from_all_rooms_lie_beyond_the_plan() -> None:
    shades = drawn()
    rooms = [room(shades, 1, 1, 4, 4)]
    fill(shades, 6, 1, 6.1, 7, WALL)
    assert measured(shades, rooms)["beyond_rooms"] > 0.3


def test_the_inside_of_what_is_solid_is_no_wall() -> None:
    shades = drawn()
    rooms = [room(shades, 1, 1, 4, 4), room(shades, 6, 1, 9, 4)]
    fill(shades, 4, 1, 6, 4, WALL)  # 2 m thick: its inside is farther from both rooms than a wall is thick
    assert measured(shades, rooms)["beyond_rooms"] == 0.0


@pytest.mark.parametrize("place", ["at a wall", "in a corner", "free"])
def test_a_map_with_a_solid_block_is_no_doubtful_plan(place: str, tmp_path: Path) -> None:
    shades = drawn(160, 200)
    room(shades, 1, 1, 9, 7)
    left, bottom = {"at a wall": (1.0, 3.0), "in a corner": (1.0, 1.0), "free": (4.0, 3.0)}[place]
    fill(shades, left, bottom, left + 2.0, bottom + 1.5, WALL)
    Image.fromarray(shades).save(tmp_path / "map.png")
    (tmp_path / "map.yaml").write_text(
        "image: map.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (plan,) = plans_of(tmp_path / "map.yaml")
    assert plan.area == pytest.approx(48.0 - 3.0 * (place != "free"), rel=0.01)
    assert plan.quality is not None
    assert plan.quality.grounds["beyond_rooms"] == 0.0


def test_a_free_margin_around_the_house_is_not_beyond_the_plan() -> None:
    shades = np.full((200, 200), FREE, np.uint8)
    assert measured(shades, [room(shades, 2, 2, 5, 5)])["beyond_rooms"] == 0.0


def test_a_ragged_room_lacks_much_of_its_convex_hull() -> None:
    shades = drawn()
    square = room(shades, 1, 1, 4, 4)
    ell = Polygon([(5, 1), (9, 1), (9, 3), (7, 3), (7, 5), (5, 5)])
    hull = 14.0  # the square of 4 m, without a corner of 2 m cut aslant
    assert measured(shades, [square, ell])["ragged_room"] == pytest.approx(1 - 12.0 / hull, abs=1e-4)


@pytest.mark.parametrize(("long_m", "sign"), [(0.6, 0.0), (2.5, 0.5), (4.5, 1.0)])
def test_a_long_wall_that_stands_in_a_room_is_a_free_wall(long_m: float, sign: float) -> None:
    shades = drawn()
    rooms = [room(shades, 1, 1, 8, 8)]
    fill(shades, 2, 4, 2 + long_m, 4.1, WALL)
    assert measured(shades, rooms)["free_wall"] == pytest.approx(sign, abs=0.03)


def test_a_wall_that_begins_at_the_edge_of_the_room_stands_in_it_too() -> None:
    shades = drawn()
    rooms = [room(shades, 1, 1, 8, 8)]
    fill(shades, 1, 4, 4.15, 4.1, WALL)
    assert measured(shades, rooms)["free_wall"] == pytest.approx(2 / 3, abs=0.05)


def test_large_maps_are_measured_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    shades = drawn(201, 199)
    rooms = [room(shades, 1, 1, 4, 4), room(shades, 5, 1, 8, 4)]
    fill(shades, 8, 0.5, 8.5, 4.5, UNSEEN)
    whole = measured(shades, rooms)
    monkeypatch.setattr(signs, "MOST_CELLS", 12_000)
    assert measured(shades, rooms) == pytest.approx(whole, abs=0.02)


def saved(folder: Path, shades: np.ndarray) -> Path:
    Image.fromarray(shades).save(folder / "map.pgm")
    file = folder / "map.yaml"
    grid = f"image: map.pgm\nresolution: {CELL_M}\norigin: [0.0, 0.0, 0.0]\n"
    file.write_text(f"{grid}negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
    return file


def test_a_map_that_shows_all_of_its_walls_is_sure_and_one_half_seen_says_why_not(tmp_path: Path) -> None:
    shades = drawn()
    room(shades, 1, 1, 4, 4)
    room(shades, 4.1, 1, 8, 4)
    fill(shades, 4, 2, 4.1, 3, FREE)
    (plan,) = plans_of(saved(tmp_path, shades))
    assert is_of_map(plan.quality.grounds)
    assert not plan.quality.is_doubtful
    fill(shades, 8, 0.5, 8.5, 4.5, UNSEEN)
    (plan,) = plans_of(saved(tmp_path, shades))
    assert plan.quality.is_doubtful
    assert plan.quality.grounds["guesses"] == 0.0
    assert main_grounds_in_words(plan.quality)[0].startswith("rooms seen in part")


def test_a_map_that_says_that_it_was_drawn_has_the_quality_of_a_drawing(tmp_path: Path) -> None:
    shades = drawn()
    room(shades, 1, 1, 4, 4)
    shades[shades == UNSEEN] = WALL
    file = saved(tmp_path, shades)
    file.write_text(file.read_text() + "walls_only: true\n")
    (plan,) = plans_of(file)
    assert not is_of_map(plan.quality.grounds)


@pytest.mark.parametrize("name", MAP_WHOLE)
def test_each_ground_of_a_map_speaks_against_it_the_more_of_it_there_is(name: str) -> None:
    most = MAP_WHOLE[name]
    no_fault = {"half_seen_rooms": 0.0}
    scores = [score_quality(no_fault | {name: value}).score for value in (0.0, most / 2, most)]
    assert scores == sorted(scores, reverse=True)
    assert scores[0] > scores[2]
    assert score_quality(no_fault | {"open_border": 1.0}).score < 0.1
