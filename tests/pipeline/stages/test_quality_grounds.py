"""Each ground is nothing in a house that speaks for itself, and as large as it should be in one that gives it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import shapely
from shapely import Polygon, box

from houseexpo.plan import DoorKind, Frame
from pipeline.geometry.areas import OUTSIDE
from pipeline.geometry.openings import Opening
from pipeline.quality import GROUNDS, score_quality
from pipeline.stages.quality_grounds import measure_quality_grounds, walls_far_from_rooms
from pipeline.values import EDGE, Evidence, Layout, Level, Mesh, SourceRoom, Spaces

ROOMS = (box(0, 0, 4, 4), box(4.2, 0, 8.2, 4), box(0, 4.2, 8.2, 8.2))
NOTHING = Polygon()
WALLS = box(-0.2, -0.2, 8.4, 8.4).difference(shapely.union_all(ROOMS))


def passage(kind: DoorKind, one: int, other: int) -> Opening:
    """A passage between two rooms; where it is makes no difference here."""
    return Opening(np.array([4.1, 1.5]), np.array([0.0, 1.0]), 0.9, 0.2, (one, other), kind)


LEVEL = Level(
    "house",
    Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64)),
    2.7,
    Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0),
    floor=box(-0.2, -0.2, 8.4, 8.4),
    rooms=tuple(SourceRoom((), (), room) for room in ROOMS),
)
EVIDENCE = Evidence(WALLS, WALLS, NOTHING, NOTHING, NOTHING)
LAYOUT = Layout(WALLS, WALLS, (), ROOMS)
SPACES = Spaces(WALLS, ROOMS, (passage("door", 0, 1), passage("opening", 0, 2), passage("entrance", 0, OUTSIDE)))


def grounds(
    level: Level = LEVEL, evidence: Evidence = EVIDENCE, layout: Layout = LAYOUT, spaces: Spaces = SPACES
) -> dict[str, float]:
    """The grounds that are more than nothing, and every one of them is known to the model."""
    found = measure_quality_grounds(level, evidence, layout, spaces)
    assert set(found) == {ground.name for ground in GROUNDS}
    assert all(0 <= value <= 1 for value in found.values())
    return {name: round(value, 3) for name, value in found.items() if value > 1e-9}


def test_nothing_speaks_against_a_house_of_which_all_is_known() -> None:
    assert grounds() == {}


def test_cuts_count_against_doors_and_against_the_rooms_that_they_alone_lead_into() -> None:
    one_cut = replace(SPACES, passages=(passage("door", 0, 1), passage("cut", 0, 2), passage("entrance", 0, OUTSIDE)))
    assert grounds(spaces=one_cut) == {"cut_share": 0.5, "cut_off_share": round(1 / 3, 3)}
    beside = replace(SPACES, passages=(*SPACES.passages, passage("cut", 1, 2)))
    assert grounds(spaces=beside) == {"cut_share": round(1 / 3, 3)}
    joined = replace(one_cut, open_pairs=((1, 2),))
    assert grounds(spaces=joined) == {"cut_share": 0.5}


def test_pieces_that_nobody_passes_mend_walls_with_holes() -> None:
    patch, way = (
        Opening.closing(box(4.0, 1, 4.2, 1.9), "gap"),
        replace(passage("door", 0, 1), polygon=box(4.0, 1, 4.2, 1.9), closed_by="lintel"),
    )
    assert grounds(layout=replace(LAYOUT, candidates=(patch, way))) == {"patch_share": 0.5}
    assert grounds(layout=replace(LAYOUT, candidates=(way,))) == {}


def test_an_open_house_was_given_its_edge() -> None:
    assert grounds(spaces=replace(SPACES, notes={"boundary": "floor_edge"})) == {"given_edge": 1.0}


def test_a_lintel_that_the_plan_has_no_door_under() -> None:
    lintels = shapely.union_all([box(4, 1, 4.2, 1.9), box(1, 4, 1.9, 4.2), box(2.5, 4, 2.8, 4.2)])  # the last is narrow
    under = replace(passage("door", 0, 1), polygon=box(4.0, 1, 4.2, 1.9), closed_by="lintel")
    evidence = replace(EVIDENCE, lintels=lintels)
    assert grounds(evidence=evidence, layout=replace(LAYOUT, candidates=(under,))) == {"idle_lintel_share": 0.5}
    elsewhere = replace(EVIDENCE, lintels=box(20, 0, 21, 0.2))
    assert grounds(evidence=elsewhere) == {}


def test_walls_that_stand_beside_no_room() -> None:
    lost = replace(EVIDENCE, walls=shapely.union_all([WALLS, box(12, 0, 12.2, 8)]))
    assert grounds(evidence=lost) == {"roomless_wall_share": round(1.6 / (WALLS.area + 1.6), 3)}


def test_doors_beside_another_and_doors_of_odd_width() -> None:
    twin = replace(SPACES, passages=(*SPACES.passages, passage("door", 1, 0)))
    assert grounds(spaces=twin) == {"twin_door_share": round(1 / 3, 3)}
    wide = tuple(replace(p, width=1.29) for p in SPACES.passages)
    assert grounds(spaces=replace(SPACES, passages=wide)) == {"odd_doors": 0.4}


def test_parts_that_were_left_out_or_filled() -> None:
    assert grounds(spaces=replace(SPACES, notes={"filled_cells": 1, "cuts": 2})) == {"left_out": round(1 / 3, 3)}
    assert grounds(spaces=replace(SPACES, notes={"left_out": 5})) == {"left_out": 1.0}
    assert grounds(spaces=replace(SPACES, notes={"closed_spaces": 1})) == {"left_out": round(1 / 3, 3)}


def test_what_the_reader_guessed() -> None:
    assert grounds(replace(LEVEL, guesses=("units",))) == {"guesses": 0.5}
    assert grounds(replace(LEVEL, guesses=("units", "up", "scale"))) == {"guesses": 1.0}
    assert grounds(replace(LEVEL, guesses=(EDGE,))) == {"guesses": 0.5, "given_edge": 1.0, "open_border": 1.0}


def test_a_room_without_a_floor_unless_there_is_hardly_any_floor_at_all() -> None:
    two_rooms = replace(LEVEL, floor=box(-0.2, -0.2, 8.4, 8.4).difference(box(0, 0, 4.1, 4.1)))
    assert grounds(replace(two_rooms, rooms=())) == {"floorless_room": 1.0}
    assert grounds(two_rooms) == {}  # the source's own room reaches over the void
    scraps = replace(LEVEL, floor=box(0, 0, 2, 2))
    assert grounds(scraps) == {}
    assert grounds(replace(LEVEL, floor=None)) == {}


def test_floor_between_the_rooms_that_is_in_none() -> None:
    lost = replace(LAYOUT, ground=WALLS.difference(box(4.0, 1, 4.2, 3)))
    assert grounds(layout=lost) == {"roomless_floor_share": round(0.16 * 2 / shapely.union_all(ROOMS).area, 3)}


def test_rooms_of_odd_shape_and_rooms_in_which_a_wall_ends() -> None:
    stub = Polygon(ROOMS[0].difference(box(2, 0, 2.1, 2)))
    bare, two = replace(LEVEL, rooms=(), floor=None), (SPACES.passages[0],)
    found = grounds(bare, layout=replace(LAYOUT, rooms=()), spaces=Spaces(WALLS, (stub, box(4.2, 0, 5, 4)), two))
    assert found.pop("odd_room_share") == found.pop("loose_end_share") == 0.5


def test_rooms_unlike_those_of_the_source() -> None:
    two = (SourceRoom((), (), box(0, 0, 8.2, 4)), SourceRoom((), (), ROOMS[2]))
    assert grounds(replace(LEVEL, rooms=two)) == {"unlike_spaces": round((1 - 16 / 32.8) / 2, 3)}
    assert grounds(replace(LEVEL, rooms=(), room_count=4)) == {"unlike_spaces": 0.25}
    assert grounds(replace(LEVEL, rooms=())) == {}


def test_one_room_that_nothing_leads_into_unless_the_source_names_it() -> None:
    level = replace(LEVEL, rooms=(), floor=None)
    sealed = Spaces(WALLS, ROOMS[:1], ())
    assert grounds(level, spaces=sealed)["sealed"] == 1.0
    assert "sealed" not in grounds(level, spaces=replace(sealed, passages=(passage("entrance", 0, OUTSIDE),)))
    assert "sealed" not in grounds(replace(level, rooms=LEVEL.rooms[:1]), spaces=sealed)


def test_a_closed_box_is_bare_unless_something_shows_its_use() -> None:
    box_of_walls = replace(LEVEL, rooms=(), floor=None)
    sealed = Spaces(WALLS, ROOMS[:1], ())
    assert grounds(box_of_walls, spaces=sealed)["bare"] == 1.0
    table, elsewhere = box(1, 1, 2, 2), box(20, 1, 21, 2)
    assert "bare" not in grounds(box_of_walls, replace(EVIDENCE, furniture=table), spaces=sealed)
    assert "bare" in grounds(box_of_walls, replace(EVIDENCE, furniture=elsewhere), spaces=sealed)
    assert "bare" not in grounds(replace(box_of_walls, only_walls=True), spaces=sealed)
    assert "bare" not in grounds(box_of_walls, replace(EVIDENCE, leaves=(box(4, 1, 4.2, 2),)), spaces=sealed)
    assert "bare" not in grounds(box_of_walls, spaces=replace(sealed, passages=(passage("entrance", 0, OUTSIDE),)))
    assert "bare" not in measure_quality_grounds(replace(box_of_walls, sills=True), EVIDENCE, LAYOUT, sealed)


def test_the_walls_of_several_buildings_are_measured_once() -> None:
    """A wall that stands alone counts, whether it is looked for anew or known already."""
    alone = box(20, 0, 30, 0.2)
    evidence = replace(EVIDENCE, walls=shapely.union_all([WALLS, alone]))
    far = walls_far_from_rooms(evidence.walls, LAYOUT.rooms)
    anew, known = (
        measure_quality_grounds(LEVEL, evidence, LAYOUT, SPACES),
        measure_quality_grounds(LEVEL, evidence, LAYOUT, SPACES, far_walls=far),
    )
    assert anew["roomless_wall_share"] == alone.area / evidence.walls.area
    assert known == anew


def test_a_source_that_reaches_above_a_storey_is_tall_unless_it_is_a_scan() -> None:
    def up_to(height_m: float) -> Level:
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 0, height_m]], float)
        return replace(LEVEL, walls=Mesh(corners, np.array([[0, 1, 2]])))

    assert grounds(up_to(3.9)) == {}
    assert grounds(up_to(7.0)) == {"tall": 0.5}
    assert grounds(up_to(30.0)) == {"tall": 1.0}
    assert grounds(up_to(30.0), replace(EVIDENCE, scanned=True)) == {}


def test_railings_beside_the_rooms_count_against_the_walls() -> None:
    railed = replace(EVIDENCE, rails=box(0, -0.1, 8.2, 0.0))
    assert grounds(evidence=railed) == {"rail_share": round(0.82 / (0.3 * WALLS.area), 3)}
    assert grounds(evidence=replace(EVIDENCE, rails=box(0, 20, 8, 20.1))) == {}


def test_a_plan_of_a_closet_is_small() -> None:
    closet = Spaces(WALLS, (box(0, 0, 3, 2.5),), (passage("entrance", 0, OUTSIDE),))
    found = grounds(replace(LEVEL, rooms=(SourceRoom((), (), closet.rooms[0]),), floor=closet.rooms[0]), spaces=closet)
    assert found["small"] == 0.5


def test_a_house_whose_source_marks_each_door_is_a_storey_for_certain() -> None:
    found = measure_quality_grounds(replace(LEVEL, sills=True), EVIDENCE, LAYOUT, SPACES)
    assert not {"tall", "rail_share", "small"} & set(found)
    assert score_quality(found, marked=True).score == score_quality({}, marked=True).score
