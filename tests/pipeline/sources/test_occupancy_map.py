"""Robots' maps become plans: maps that are known by hand, maps with noise, and maps that our own export writes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image

from houseexpo.errors import ConfigError
from houseexpo.exports import export
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from pipeline.config import PipelineConfig
from pipeline.rejection import Reason
from pipeline.sources import find, reader
from pipeline.sources.occupancy_map import _flatten_doorways, _opening_of
from pipeline.sources.occupancy_map.enclosure import fill_between_rays
from pipeline.sources.occupancy_map.gaps import find_gaps
from pipeline.sources.occupancy_map.rooms import RoomConnection
from pipeline.stages.layout import read_drawn_layout
from tests.builders.batch import likeness, plans_of
from tests.builders.damage import rejected
from tests.builders.shared import DATA, needs_shared

CELL_M = 0.05
FREE, WALL, UNSEEN = 254, 0, 205


def two_rooms() -> np.ndarray:
    """A room of 4 m x 3 m and one of 3 m x 3 m; the door between them is 0.9 m wide, 1.0 m from the lower wall."""
    shades = np.full((80, 170), UNSEEN, np.uint8)
    shades[8:72, 8:156] = WALL
    shades[10:70, 10:90] = FREE
    shades[10:70, 94:154] = FREE
    shades[32:50, 90:94] = FREE  # row 0 is at the top: 20 to 38 cells above the lower wall
    return shades


def saved(folder: Path, shades: np.ndarray, name: str = "map", **keys: Any) -> Path:
    Image.fromarray(shades).save(folder / f"{name}.pgm")
    said = {"image": f"{name}.pgm", "resolution": CELL_M, "origin": [0.0, 0.0, 0.0], "negate": 0}
    said |= {"occupied_thresh": 0.65, "free_thresh": 0.196} | keys
    file = folder / f"{name}.yaml"
    file.write_text("".join(f"{key}: {value}\n" for key, value in said.items()))
    return file


def areas(plan: FloorPlan) -> list[float]:
    return sorted(room.polygon.area for room in plan.rooms)


def test_two_rooms_and_their_door(tmp_path: Path) -> None:
    (plan,) = plans_of(saved(tmp_path, two_rooms()))
    assert areas(plan) == pytest.approx([9.0, 12.0], rel=0.03)
    (door,) = plan.doors
    assert door.kind == "door"
    assert door.width == pytest.approx(0.9, abs=0.1)
    assert plan.provenance["source"] == "robot's map"


def test_what_is_unknown_around_a_map_changes_nothing(tmp_path: Path) -> None:
    """A map of 2,400 x 2,400 cells, as gmapping writes them, in a part of which the robot has been."""
    whole = np.full((2400, 2400), UNSEEN, np.uint8)
    whole[900:980, 1300:1470] = two_rooms()
    (plan,) = plans_of(saved(tmp_path, two_rooms(), origin=[65.0, 71.0, 0.0]))
    (found,) = plans_of(saved(tmp_path, whole))
    assert areas(found) == pytest.approx(areas(plan))
    places = [source_points_from_plan(each.frame, [each.doors[0].polygon.centroid.coords[0]]) for each in (plan, found)]
    assert places[0] == pytest.approx(places[1], abs=0.01)


def test_the_frame_is_that_of_the_map(tmp_path: Path) -> None:
    """The door's middle is 4.6 m right of and 1.95 m above the lower-left corner of the grid, which is turned."""
    (plan,) = plans_of(saved(tmp_path, two_rooms(), origin=[-3.0, 7.0, 0.5]))
    ((x, y),) = source_points_from_plan(plan.frame, [plan.doors[0].polygon.centroid.coords[0]]).tolist()
    right, up = 4.6, 1.95
    assert x == pytest.approx(-3.0 + right * math.cos(0.5) - up * math.sin(0.5), abs=0.1)
    assert y == pytest.approx(7.0 + right * math.sin(0.5) + up * math.cos(0.5), abs=0.1)


def test_noise_and_clutter_change_neither_rooms_nor_doors(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    shades = two_rooms()
    shades[25:35, 30:42] = WALL  # a table
    shades[rng.random(shades.shape) < 0.002] = WALL
    shades[9, 20:40] = FREE  # a rough wall
    (plan,) = plans_of(saved(tmp_path, shades))
    assert areas(plan) == pytest.approx([9.0, 12.0], rel=0.06)
    assert [door.kind for door in plan.doors] == ["door"]


def test_a_wide_way_is_an_opening(tmp_path: Path) -> None:
    shades = two_rooms()
    shades[25:55, 90:94] = FREE
    (plan,) = plans_of(saved(tmp_path, shades))
    assert [door.kind for door in plan.doors] == ["opening"]


def test_a_way_wider_than_any_door_is_an_opening(tmp_path: Path) -> None:
    """2.9 m of a wall of 12 m are open."""
    shades = corridor_with_rooms(58)
    (plan,) = plans_of(saved(tmp_path, shades))
    assert [door.kind for door in plan.doors] == ["opening", "opening"]
    assert [door.width for door in plan.doors] == pytest.approx([2.9, 2.9], abs=0.2)


def test_a_slit_beside_a_corner_becomes_a_door_that_both_rooms_have(tmp_path: Path) -> None:
    """The thin wall between two rooms ends two cells before the wall below."""
    shades = two_rooms()
    shades[10:70, 90:94] = WALL
    shades[10:70, 90:92] = FREE
    shades[68:70, 92:94] = FREE
    (plan,) = plans_of(saved(tmp_path, shades))
    (door,) = plan.doors
    assert (door.kind, door.width) == ("door", pytest.approx(0.6, abs=0.05))
    assert len(plan.rooms) == 2


def test_a_map_of_walls_alone_has_no_furniture(tmp_path: Path) -> None:
    """A pillar of 0.5 m, and a corner that is cut off by 1 m x 1 m: furniture in a robot's map, wall in a drawn one."""
    shades = two_rooms()
    shades[30:40, 30:40] = WALL
    shades[10:30, 10:30] = WALL
    (plan,) = plans_of(saved(tmp_path, shades))
    (drawn,) = plans_of(saved(tmp_path, shades, walls_only="true"))
    assert areas(plan) == pytest.approx([9.0, 12.0], rel=0.03)
    assert areas(drawn) == pytest.approx([9.0, 10.75], rel=0.005)
    assert [door.width for door in drawn.doors] == pytest.approx([0.9])


def test_a_map_of_walls_alone_keeps_slanting_walls(tmp_path: Path) -> None:
    """Without its steps: a triangle of 2.5 m x 2.5 m is cut off a room of 4 m x 3 m."""
    shades = two_rooms()
    row, col = np.indices(shades.shape)
    shades[(row - 10) + (col - 10) < 50] = WALL
    (plan,) = plans_of(saved(tmp_path, shades, walls_only="true"))
    assert areas(plan) == pytest.approx([12.0 - 3.125, 9.0], rel=0.01)
    assert max(len(room.ring) for room in plan.rooms) <= 9


@pytest.mark.parametrize("suffix", [".png", ".npy"])
def test_a_picture_and_an_array_need_the_side_of_a_cell(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"floor{suffix}"
    if suffix == ".png":
        Image.fromarray(two_rooms()).save(path)
    else:
        np.save(path, np.where(two_rooms() == FREE, 0, 100).astype(np.int8))
    assert rejected(path).reason is Reason.BAD_UNITS
    assert "read as a robot's map: give --resolution" in rejected(path).advice
    (item,) = find(str(path), resolution="0.05")
    (level,) = reader(item.reader).read(item)
    assert sorted(room.polygon.area for room in level.rooms) == pytest.approx([9.0, 12.0], rel=0.03)


@pytest.mark.parametrize("resolution", ["0", "-1", "nan", "inf"])
def test_an_impossible_side_of_a_cell_is_refused_before_anything_is_read(tmp_path: Path, resolution: str) -> None:
    with pytest.raises(ConfigError, match=f"resolution='{resolution}': expected a number above 0"):
        list(find(str(tmp_path), resolution=resolution))


def test_a_folder_gives_each_map_once(tmp_path: Path) -> None:
    saved(tmp_path, two_rooms())
    Image.fromarray(two_rooms()).save(tmp_path / "alone.png")
    assert [Path(item.path).name for item in find(str(tmp_path))] == ["map.yaml"]
    names = [Path(item.path).name for item in find(str(tmp_path), resolution="0.05")]
    assert names == ["alone.png", "map.yaml"]


def test_unseen_space_is_a_guess(tmp_path: Path) -> None:
    shades = two_rooms()
    shades[:10] = UNSEEN
    (plan,) = plans_of(saved(tmp_path, shades))
    (sure,) = plans_of(saved(tmp_path, two_rooms()))
    assert plan.provenance["unseen_edge"] == pytest.approx(7.0 / 27.0, abs=0.06)
    assert sure.provenance["unseen_edge"] == pytest.approx(0.0, abs=0.01)
    assert plan.quality.score < sure.quality.score


def fan_through_the_door(reach: int) -> np.ndarray:
    """The left of ``two_rooms``, and what two rays through the door leave between them, ``reach`` cells far."""
    shades = two_rooms()
    row, col = np.indices(shades.shape)
    right = col > 94
    shades[right] = UNSEEN
    shades[right & (np.abs(row - 41) < 9 + 0.4 * (col - 94)) & (col < 94 + reach)] = FREE
    return shades


def test_a_fan_of_rays_through_a_door_is_no_room_and_the_door_is_an_entrance(tmp_path: Path) -> None:
    (plan,) = plans_of(saved(tmp_path, fan_through_the_door(60)))
    assert areas(plan) == [pytest.approx(12.0, abs=0.3)]
    (door,) = plan.doors
    assert (door.rooms[1:], door.width) == (() if len(door.rooms) == 1 else (None,), pytest.approx(0.9, abs=0.1))


def test_a_room_ends_where_a_spike_of_rays_leaves_it(tmp_path: Path) -> None:
    """Through a gap of 2 m in the right wall, two rays see 4 m of unseen space."""
    shades = two_rooms()
    row, col = np.indices(shades.shape)
    shades[:, 94:] = UNSEEN
    shades[20:60, 90:94] = FREE
    shades[(col >= 94) & (np.abs(row - 40) < 20 - 0.1 * (col - 94)) & (col < 165)] = FREE
    (plan,) = plans_of(saved(tmp_path, shades))
    assert areas(plan) == [pytest.approx(12.0, abs=1.2)]  # with the spike, it has 17 m2


def test_a_map_of_which_nothing_but_the_ends_of_rays_bounds_the_rooms_is_doubtful(tmp_path: Path) -> None:
    shades = np.full((200, 200), UNSEEN, np.uint8)
    row, col = np.indices(shades.shape)
    shades[np.hypot(row - 100, col - 100) < 80] = FREE
    shades[90:94, 60:64] = shades[120:124, 130:134] = WALL
    (plan,) = plans_of(saved(tmp_path, shades))
    assert plan.provenance["unseen_edge"] > 0.9
    assert plan.provenance["rooms_seen_in_part"] == 1
    assert plan.quality.score < 0.4


@pytest.mark.parametrize(("back", "area_m2"), [(False, 11.0), (True, 12.0)])
def test_unseen_space_is_filled_behind_furniture_and_not_behind_a_wall(
    tmp_path: Path, back: bool, area_m2: float
) -> None:
    """What stands in a corner is 2 m x 0.5 m; its front was seen, and the wall behind it only if ``back``."""
    shades = two_rooms()
    shades[:, 94:] = UNSEEN
    shades[10:70, 90:94] = WALL
    shades[10:50, 80:90] = UNSEEN
    shades[10:50, 80] = shades[49, 80:90] = WALL
    shades[6:50, 88:96] = WALL if back else UNSEEN
    shades[6:10, 78:96] = WALL if back else UNSEEN
    (plan,) = plans_of(saved(tmp_path, shades))
    assert areas(plan) == [pytest.approx(area_m2, abs=0.3)]


@needs_shared
def test_a_face_at_a_doorway_that_leaves_a_line_is_drawn_all_the_same() -> None:
    """On the grid of the outlines, the union of this map's rooms with faces at doorways has lines of 0.1 mm."""
    (item,) = find(str(DATA / "maps" / "bormann" / "freiburg_building101.png"), resolution="0.05")
    (level,) = reader(item.reader).read(item)
    assert len(level.rooms) == 9


@needs_shared
def test_a_doorway_is_as_wide_as_both_of_its_rooms_reach() -> None:
    """Right before a doorway, from jamb to jamb, no wall stands."""
    (item,) = find(str(DATA / "maps" / "bormann" / "lab_ipa.png"), resolution="0.05")
    (level,) = reader(item.reader).read(item)
    rooms = shapely.union_all([room.polygon for room in level.rooms])
    assert level.openings
    for opening in level.openings:
        one, other, across, beside = shapely.get_coordinates(opening.polygon)[:4]
        faces = shapely.linestrings([[one, other], [beside, across]])
        step = 0.02 * (beside - one) / np.hypot(*(beside - one))
        for face, away in zip(faces, (-step, step), strict=True):
            line = shapely.transform(face, lambda points, away=away: points + away)
            assert shapely.intersection(line, rooms).length > line.length - 0.03


@needs_shared
@pytest.mark.parametrize("name", ["lab_ipa", "lab_c_scan", "lab_f_scan", "office_d"])
def test_the_rooms_and_doorways_of_a_map_are_taken_as_they_are_drawn(name: str) -> None:
    """With a wall before a part of a doorway, or doorways that meet, they would be searched for, which takes long."""
    (item,) = find(str(DATA / "maps" / "bormann" / f"{name}.png"), resolution="0.05")
    (level,) = reader(item.reader).read(item)
    drawn = read_drawn_layout(level, PipelineConfig().layout)
    assert drawn is not None
    assert len(drawn.layout.rooms) == len(level.rooms)


def in_a_white_margin(shades: np.ndarray) -> np.ndarray:
    """A map of which all that is unknown was painted white, with a margin of 2 m around it and a door of 0.9 m."""
    wide = np.pad(np.where(shades == UNSEEN, FREE, shades), 40, constant_values=FREE)
    wide[75:93, 45:52] = FREE  # through the left wall
    return wide


def test_a_white_margin_is_outside_and_its_doors_are_entrances(tmp_path: Path) -> None:
    (plan,) = plans_of(saved(tmp_path, in_a_white_margin(two_rooms())))
    assert areas(plan) == pytest.approx([9.0, 12.0], rel=0.03)
    assert sorted(door.kind for door in plan.doors) == ["door", "entrance"]
    assert [door.width for door in plan.doors] == pytest.approx([0.9, 0.9], abs=0.15)


def test_a_corner_of_a_thin_margin_is_outside_too(tmp_path: Path) -> None:
    """A margin of a cell, in pieces too small to count, and a notch of 2 m x 2 m in the house at a corner."""
    shades = np.full((100, 100), WALL, np.uint8)
    shades[[0, -1], 1:-1] = shades[1:-1, [0, -1]] = FREE
    shades[4:96, 4:96] = FREE
    shades[56:99, 56:99] = WALL
    shades[60:, 60:] = FREE
    shades[[0, 99, 99, 58], [58, 0, 58, 99]] = WALL
    (plan,) = plans_of(saved(tmp_path, shades))
    assert areas(plan) == pytest.approx([(92 * 92 - 40 * 40) * CELL_M**2], rel=0.03)


def test_a_white_line_around_the_picture_is_a_frame_and_no_margin(tmp_path: Path) -> None:
    """Somebody drew a frame around a robot's map, and single rays out of a room end at it."""
    shades = np.pad(two_rooms(), 40, constant_values=UNSEEN)
    shades[80:84, :52] = FREE
    shades[[0, -1]] = shades[:, [0, -1]] = FREE
    (plan,) = plans_of(saved(tmp_path, shades))
    assert areas(plan) == pytest.approx([9.0, 12.0], rel=0.05)
    assert [door.kind for door in plan.doors] == ["door"]


def test_a_room_at_the_border_of_a_cropped_map_stays_a_room(tmp_path: Path) -> None:
    (plan,) = plans_of(saved(tmp_path, two_rooms()[10:, 10:]))
    assert areas(plan) == pytest.approx([9.0, 12.0], rel=0.03)
    assert plan.provenance["unseen_edge"] == pytest.approx(10.0 / 27.0, abs=0.06)  # nothing is seen beyond the border


def test_a_map_of_open_ground_is_one_space(tmp_path: Path) -> None:
    """Without a house in it, there is nothing to be outside of."""
    shades = np.full((80, 120), FREE, np.uint8)
    (plan,) = plans_of(saved(tmp_path, shades))
    assert areas(plan) == pytest.approx([24.0], rel=0.03)
    assert plan.quality.score < 0.5
    assert plan.provenance["open_border"] == 1.0


def without_white(shades: np.ndarray) -> np.ndarray:
    """What map_saver writes where no cell was marked free: black on 205, which ``free_thresh: 0.25`` makes free."""
    return np.where(shades == FREE, UNSEEN, shades)


def test_black_on_unseen_space_that_the_thresholds_make_free_is_doubtful(tmp_path: Path) -> None:
    """The walls of two rooms with gaps of 1 m in them, so that nothing is inside and nothing outside."""
    shades = without_white(two_rooms())
    shades[32:52, 8:10] = shades[32:52, 154:156] = UNSEEN
    shades = np.pad(np.where(np.indices(shades.shape)[1] % 60 < 20, UNSEEN, shades), 40, constant_values=UNSEEN)
    (plan,) = plans_of(saved(tmp_path, shades.astype(np.uint8), free_thresh=0.25))
    assert plan.quality.score < 0.5
    assert plan.provenance["open_border"] == 1.0
    assert plan.provenance["unseen_edge"] > 0.5


def test_a_closed_plan_in_black_on_grey_stays_a_plan(tmp_path: Path) -> None:
    (plan,) = plans_of(saved(tmp_path, without_white(two_rooms()), free_thresh=0.25))
    assert areas(plan) == pytest.approx([9.0, 12.0], rel=0.03)
    assert plan.quality.score > 0.8
    assert "open_border" not in plan.provenance


def test_a_doorway_at_a_corner_leaves_a_wall_between_the_rooms(tmp_path: Path) -> None:
    """A box in a hall; its right wall ends 1.5 m above its lower right corner, and the lower wall at this corner."""
    shades = np.full((240, 240), WALL, np.uint8)
    shades[4:236, 4:236] = FREE
    shades[60:180, 60:180] = WALL
    shades[64:176, 64:176] = FREE
    shades[146:176, 176:180] = FREE
    (plan,) = plans_of(saved(tmp_path, shades))
    assert len(plan.rooms) == 2
    assert [door.kind for door in plan.doors] == ["opening"]
    assert plan.doors[0].width == pytest.approx(1.5, abs=0.2)


def corridor_with_rooms(opening: int) -> np.ndarray:
    """A corridor of 12 m x 2 m, two rooms of 5.9 m x 5 m below it, and ``opening`` cells of wall open to each."""
    shades = np.full((156, 252), WALL, np.uint8)
    shades[6:46, 6:246] = FREE
    for left in (6, 128):
        shades[50:150, left : left + 118] = FREE
        shades[46:50, left + 40 : left + 40 + opening] = FREE
    return shades


@pytest.mark.parametrize("turn_deg", [0.0, 20.0])
def test_an_opening_as_wide_as_the_corridor_parts_it_from_the_room(tmp_path: Path, turn_deg: float) -> None:
    picture = Image.fromarray(corridor_with_rooms(44)).rotate(turn_deg, expand=True, fillcolor=WALL)
    (plan,) = plans_of(saved(tmp_path, np.asarray(picture)))
    assert areas(plan) == pytest.approx([24.0, 29.5, 29.5], rel=0.04)
    assert [door.kind for door in plan.doors] == ["opening", "opening"]
    assert [door.width for door in plan.doors] == pytest.approx([2.2, 2.2], abs=0.2)


def corridor_with_a_dashed_wall(gap: int, pieces: tuple[int, ...]) -> np.ndarray:
    """A corridor of 12 m x 2 m and a room of 12 m x 5 m; pieces of wall of so many cells between them, and gaps."""
    shades = np.full((156, 252), WALL, np.uint8)
    shades[6:46, 6:246] = FREE
    shades[50:150, 6:246] = FREE
    shades[46:50, 6:246] = FREE
    at = 6 + (240 - sum(pieces) - gap * (len(pieces) - 1)) // 2
    for long in pieces:
        shades[47:49, at : at + long] = WALL
        at += long + gap
    return shades


@pytest.mark.parametrize("turn_deg", [0.0, 20.0])
def test_a_wall_that_was_seen_as_dashes_parts_the_corridor_from_the_room(tmp_path: Path, turn_deg: float) -> None:
    """Each dash is shorter than a piece of wall between two doors, and all of them stand alone."""
    shades = corridor_with_a_dashed_wall(gap=12, pieces=(15,) * 9)
    picture = Image.fromarray(shades).rotate(turn_deg, expand=True, fillcolor=WALL)
    (plan,) = plans_of(saved(tmp_path, np.asarray(picture)))
    assert areas(plan) == pytest.approx([24.0, 60.0], rel=0.05)
    assert plan.doors


def test_a_row_of_columns_in_a_hall_is_no_wall(tmp_path: Path) -> None:
    """Columns of 0.3 m every 2.3 m."""
    shades = corridor_with_a_dashed_wall(gap=40, pieces=(6,) * 5)
    (plan,) = plans_of(saved(tmp_path, shades))
    assert areas(plan) == pytest.approx([12.0 * 7.2], rel=0.03)


def test_rows_of_tables_in_a_hall_are_no_walls(tmp_path: Path) -> None:
    """Four rows of tables of 1.5 m x 1.5 m, 1.5 m apart, in a hall of 18 m x 12 m."""
    shades = np.full((252, 372), WALL, np.uint8)
    shades[6:246, 6:366] = FREE
    for top in range(36, 230, 60):
        for left in range(6, 340, 60):
            shades[top : top + 30, left : left + 30] = WALL
    (plan,) = plans_of(saved(tmp_path, shades))
    assert len(plan.rooms) == 1


def test_a_doorway_that_was_seen_as_rays_is_a_gap() -> None:
    """Every fourth column is unseen in the left doorway and behind it, and none at the right one."""
    shades = corridor_with_rooms(44)
    occupied = shades == WALL
    behind = np.zeros(shades.shape, bool)
    behind[46:, :124:4] = True
    free = (shades == FREE) & ~behind
    for seen, count in ((free, 1), (fill_between_rays(free, occupied, CELL_M), 2)):
        gaps, walls = find_gaps(free, CELL_M, 0.0, bare=free, seen=seen)
        assert len(gaps) == count
        assert (np.abs(gaps[..., 1] - 46) <= 3).all()
        assert np.ptp(gaps[..., 0], axis=1) == pytest.approx(np.full(count, 44.0), abs=3)
        assert (walls == gaps).all()


def test_the_unseen_inside_of_a_wall_is_not_between_rays() -> None:
    """A wall of 0.2 m between two rooms, of which no cell counts as occupied, as in pictures with soft edges."""
    free = np.ones((80, 84), bool)
    free[:, 40:44] = False
    rays = free.copy()
    rays[:, 44::3] = False
    nothing = np.zeros(free.shape, bool)
    assert (fill_between_rays(free, nothing, CELL_M) == free).all()
    assert fill_between_rays(rays, nothing, CELL_M)[:, 50:].all()


def test_walls_in_line_across_a_corridor_do_not_cut_it(tmp_path: Path) -> None:
    """Rooms above and below a corridor of 2 m, all with their walls in line; the doors are narrow."""
    shades = np.full((260, 252), WALL, np.uint8)
    shades[110:150, 6:246] = FREE
    for top, door in ((6, 106), (154, 150)):
        for left in (6, 128):
            shades[top : top + 100, left : left + 118] = FREE
            shades[door : door + 4, left + 40 : left + 58] = FREE
    (plan,) = plans_of(saved(tmp_path, shades))
    assert areas(plan) == pytest.approx([24.0, 29.5, 29.5, 29.5, 29.5], rel=0.03)


def test_unknown_space_of_a_retouched_map_is_no_room(tmp_path: Path) -> None:
    """Nav2's threshold of 0.25 makes map_saver's 205 free by the letter; five cells were painted white."""
    shades = two_rooms()
    shades[20, 20:25] = 255
    (plan,) = plans_of(saved(tmp_path, shades, free_thresh=0.25))
    assert areas(plan) == pytest.approx([9.0, 12.0], rel=0.03)
    assert plan.provenance["unknown_shade"] == UNSEEN
    (plain,) = plans_of(saved(tmp_path, shades))
    assert "unknown_shade" not in plain.provenance


@pytest.mark.parametrize(
    ("keys", "reason", "said"),
    [
        ({"image": "gone.pgm"}, Reason.MISSING_FILE, "gone.pgm"),
        ({"image": "../map.pgm"}, None, ""),
        ({"image": "/etc/passwd"}, Reason.MISSING_FILE, "passwd"),
        ({"resolution": 0}, Reason.BAD_UNITS, "resolution"),
        ({"resolution": ".nan"}, Reason.BAD_UNITS, "resolution"),
        ({"negate": 1}, Reason.EMPTY, "no free cell"),
        ({"origin": "[.inf, 0, 0]"}, Reason.BAD_UNITS, "origin"),
    ],
)
def test_bad_maps_are_refused_with_their_reason(
    tmp_path: Path, keys: dict[str, Any], reason: Reason | None, said: str
) -> None:
    shades = two_rooms()
    shades[shades == UNSEEN] = FREE if "negate" in keys else UNSEEN
    shades[shades == WALL] = 128 if "negate" in keys else WALL
    path = saved(tmp_path, shades, **keys)
    if reason is None:  # map_server's old maps name the folder of another machine: the picture beside counts
        (plan,) = plans_of(path)
        assert len(plan.rooms) == 2
        return
    found = rejected(path)
    assert found.reason is reason
    assert said in found.detail


def test_specks_are_no_rooms(tmp_path: Path) -> None:
    shades = np.full((60, 60), UNSEEN, np.uint8)
    shades[10:14, 10:14] = FREE
    found = rejected(saved(tmp_path, shades))
    assert found.reason is Reason.NO_LEVEL
    assert "let the robot map more" in found.advice


def test_a_map_whose_cells_are_too_small_for_a_room_is_refused_at_once(tmp_path: Path) -> None:
    shades = np.full((300, 300), FREE, np.uint8)
    shades[[0, -1]] = shades[:, [0, -1]] = WALL
    found = rejected(saved(tmp_path, shades, resolution=0.0001))
    assert found.reason is Reason.NO_LEVEL
    assert "found 0.00089 m² in all" in found.detail


@pytest.mark.parametrize(("style", "more"), [("published", 1), ("sound", 2)])
@pytest.mark.parametrize("number", range(3))
def test_what_is_exported_as_a_map_comes_back(tmp_path: Path, number: int, style: str, more: int) -> None:
    """The map has the free space of the plan, and its rooms: an open living room, dining room and kitchen may be one, a
    cupboard a part of the hall, and a part of the hall a room."""
    plan = plans_of(Path(f"procedural:{number + 1}?style={style}"))[-1]
    export([plan], "ros", tmp_path)
    (file,) = tmp_path.rglob("*.yaml")
    (back,) = plans_of(file)
    assert likeness(plan, back) > 0.9
    assert -3 <= len(back.rooms) - len(plan.rooms) <= more


def test_no_sliver_of_a_room_lies_behind_its_doorway() -> None:
    """The upper room goes on around the end of the wall, and back below it to a part of the doorway."""
    below = shapely.union_all([shapely.box(0, 0, 4, 1.5), shapely.box(0, 1.5, 1.6, 2.0)])
    above = shapely.union_all(
        [shapely.box(0, 2.2, 4, 4), shapely.box(2.3, 1.9, 4, 2.2), shapely.box(1.9, 1.9, 2.3, 1.95)]
    )
    slot = _opening_of(RoomConnection((1, 2), np.array([[10.0, 19.0], [20.0, 19.0]]), 1.0, 0.2), 0.1, 4.0)
    (low, high), (hole,) = _flatten_doorways([slot], {1: below, 2: above}, frozenset())
    assert not shapely.intersects(shapely.box(0.95, 1.96, 2.05, 1.99), high)
    for room, y in ((low, 1.99), (high, 2.21)):
        assert shapely.covers(room, shapely.LineString([(1.05, y), (1.95, y)]))
    assert (
        hole.shape.equals(shapely.box(1.0, 2.0, 2.0, 2.2))
        or hole.shape.symmetric_difference(shapely.box(1.0, 2.0, 2.0, 2.2)).area < 1e-6
    )


def test_doorways_do_not_meet_and_one_on_a_wider_one_is_left_out() -> None:
    """Two doorways meet at (2, 2), where three rooms do; a third one lies on the second, between the same rooms."""
    rooms = {1: shapely.box(0, 0, 1.9, 1.9), 2: shapely.box(2.1, 0, 4, 1.9), 3: shapely.box(0, 2.1, 4, 4)}
    ways = (
        ((1, 2), (20.0, 20.0), (20.0, 30.0)),
        ((1, 3), (6.0, 20.0), (20.5, 20.0)),
        ((1, 3), (9.0, 20.0), (15.0, 20.0)),
    )
    slots = [_opening_of(RoomConnection(pair, np.array(ends), 1.0, 0.2), 0.1, 4.0) for pair, *ends in ways]
    _, holes = _flatten_doorways(slots, rooms, frozenset())
    upright, level = (hole.shape for hole in holes)
    assert not shapely.dwithin(upright, level, 0.03)
    assert upright.bounds == pytest.approx((1.9, 1.0, 2.1, 1.86), abs=1e-3)
    assert level.bounds[:3] == pytest.approx((0.6, 1.9, 2.05), abs=1e-3)


def test_a_map_is_known_by_its_name_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """To ask the readers of drawings would load all of them."""
    np.save(tmp_path / "map.npy", np.zeros((60, 60), np.int8))
    monkeypatch.setattr("pipeline.sources.reader_for_file", lambda path: pytest.fail(f"asked for {path}"))
    (item,) = find(str(tmp_path / "map.npy"), resolution="0.05")
    assert item.reader == "occupancy_map"
