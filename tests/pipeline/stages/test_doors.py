"""Stage doors: which differences of the two planes are passages, of what kind, between which rooms."""

import numpy as np
import pytest
import shapely

from pipeline.config import DoorsConfig, PipelineConfig
from pipeline.stages.doors import find_doors
from pipeline.values import Opening, SourceObject, Spaces
from tests.builders.houses import (
    Hole,
    Parts,
    gap,
    kinds,
    level,
    sheet_wall,
    shell,
    stage_values,
    three_rooms,
    two_rooms,
    wall,
    window,
)
from tests.builders.meshes import box


def doors(parts: Parts, config: DoorsConfig | None = None, **values: object) -> Spaces:
    house = level(parts, **values)
    return stage_values(house, PipelineConfig(doors=config or DoorsConfig()))["doors"]


def test_a_door_has_its_place_width_and_rooms() -> None:
    (door,) = doors(two_rooms(Hole(1.0, 1.9))).passages
    assert door.kind == "door"
    assert door.centre == pytest.approx([4.1, 1.45], abs=1e-3)
    assert (door.width, door.depth) == pytest.approx((0.9, 0.2), abs=5e-3)  # refine fits it exactly
    assert set(door.sides) == {0, 1}


@pytest.mark.parametrize("named", [True, False])
def test_a_pane_as_wide_as_a_door_is_none_where_the_source_names_its_doors(named: bool) -> None:
    pane = box((4.0, 1.6, 4.05, 2.5), 0.0, 2.0)
    door = Opening.named(shapely.box(4.0, 0.3, 4.2, 1.2), has_door=True)
    found = doors([*two_rooms(Hole(0.3, 1.2), Hole(1.6, 2.5)), pane], openings=(door,), named_openings=named)
    assert kinds(found) == ["door"] * (1 if named else 2)


@pytest.mark.parametrize("named", [True, False])
def test_a_gap_beside_the_leaf_of_a_named_door_is_an_opening(named: bool) -> None:
    between = [*wall((4.0, 0.0, 4.2, 1.6), Hole(0.3, 1.2)), *wall((4.0, 2.5, 4.2, 5.0))]
    leaf = SourceObject(("door",), box((4.2, 1.5, 5.1, 1.55), 0.0, 2.0))
    door = Opening.named(shapely.box(4.0, 0.3, 4.2, 1.2), has_door=True)
    house = [*shell((0.0, 0.0, 8.2, 5.0)), *between]
    found = doors(house, openings=(door,), leaves=(leaf,), named_openings=named)
    assert sorted(kinds(found)) == ["door", "opening" if named else "door"]


@pytest.mark.parametrize("values", [{"named_openings": True}, {}])
def test_a_sliding_door_of_three_metres_is_a_door_where_the_source_names_it(values: dict[str, object]) -> None:
    between = wall((4.0, 0.0, 4.2, 5.0), Hole(1.0, 4.0))
    house = [*shell((0.0, 0.0, 8.2, 5.0)), *between]
    door = Opening.named(shapely.box(4.0, 1.0, 4.2, 4.0), has_door=True)
    assert kinds(doors(house, openings=(door,), **values)) == ["door"]
    assert kinds(doors(house)) == []


def test_a_named_leaf_of_three_metres_is_a_door() -> None:
    between = wall((4.0, 0.0, 4.2, 5.0), Hole(1.0, 4.0))
    leaf = SourceObject(("sliding door",), box((4.07, 1.0, 4.13, 4.0), 0.0, 2.0))
    assert kinds(doors([*shell((0.0, 0.0, 8.2, 5.0)), *between], leaves=(leaf,))) == ["door"]


def test_two_doors_in_one_wall() -> None:
    found = doors(two_rooms(Hole(0.3, 1.1), Hole(1.8, 2.6)))
    assert kinds(found) == ["door", "door"]
    assert sorted(round(p.centre[1], 2) for p in found.passages) == [0.7, 2.2]


def test_three_rooms_in_a_row() -> None:
    found = doors(three_rooms([Hole(1, 1.9)], [Hole(0.5, 1.4)]))
    assert kinds(found) == ["door", "door"]
    middle = next(k for k, room in enumerate(found.rooms) if 3.1 <= room.centroid.x <= 6.1)
    assert all(middle in p.sides for p in found.passages)


@pytest.mark.parametrize(("hole", "kind"), [(Hole(1, 1.9), "door"), (gap(1, 1.9), "opening"), (gap(1, 2.2), "opening")])
def test_a_lintel_makes_a_door_and_a_full_gap_an_opening(hole: Hole, kind: str) -> None:
    found = doors(two_rooms(hole))
    assert kinds(found) == [kind]
    assert found.passages[0].width == pytest.approx(hole.end - hole.start, abs=2e-3)
    assert found.open_pairs == ()


@pytest.mark.parametrize("width", [0.5, 1.2, 2.4, 2.6, 3.2])
def test_a_gap_of_full_height_is_an_opening_however_wide(width: float) -> None:
    halls = [*shell((0.0, 0.0, 12.0, 8.0)), *wall((6.0, 0.0, 6.2, 8.0), gap(2.0, 2.0 + width))]
    found = doors(halls)
    assert kinds(found) == ["opening"]
    assert found.passages[0].width == pytest.approx(width, abs=2e-3)


def test_an_entrance_stays_closed_and_a_window_is_none() -> None:
    found = doors([*shell((0, 0, 5, 4), front=[Hole(1, 2), window(3, 4)])])
    assert kinds(found) == ["entrance"]
    assert found.passages[0].leads_outside
    assert found.walls.covers(shapely.box(1, -0.2, 2, 0).buffer(-0.01))


def test_a_hole_too_narrow_for_anybody_is_wall() -> None:
    assert doors(two_rooms(Hole(1.0, 1.3))).passages == ()
    assert len(doors(two_rooms(Hole(1.0, 1.3)), DoorsConfig(narrowest_m=0.25)).passages) == 1


def test_rooms_under_a_wide_lintel_meet_without_a_door() -> None:
    found = doors(two_rooms(Hole(0.2, 2.8)))  # 2.6 m
    assert found.passages == ()
    assert found.open_pairs == ((0, 1),)
    # each has its half of what lies under the lintel
    assert [room.area for room in found.rooms] == pytest.approx([12 + 0.26, 9 + 0.26], abs=0.02)
    assert sum(room.area for room in found.rooms) == pytest.approx(21.52, abs=1e-3)


@pytest.mark.parametrize("post", [0.1, 0.25])
def test_a_post_under_a_beam_makes_no_doors(post: float) -> None:
    parts = [*shell((0, 0, 8, 3)), box((4, 0, 4.2, 3), 2.1, 2.5), box((4, 1.5, 4.2, 1.5 + post), 0, 2.1)]
    found = doors(parts)
    assert found.passages == ()
    assert len(found.rooms) == 1 or found.open_pairs == ((0, 1),)


def test_a_wide_pier_between_two_doors_keeps_them_doors() -> None:
    assert kinds(doors(two_rooms(Hole(0.2, 1.2), Hole(1.8, 2.8)))) == ["door", "door"]


@pytest.mark.parametrize(("has_door", "kind"), [(True, "door"), (False, "opening")])
def test_the_source_says_what_an_opening_is(has_door: bool, kind: str) -> None:
    named = Opening.named(shapely.box(3.9, 1.0, 4.3, 1.9), has_door)
    assert kinds(doors(two_rooms(Hole(1.0, 1.9)), openings=(named,))) == [kind]


def test_where_the_source_names_its_openings_another_hole_in_a_wall_is_an_opening() -> None:
    named = Opening.named(shapely.box(3.9, 2.2, 4.3, 2.9), has_door=True)
    found = doors(two_rooms(Hole(0.5, 1.4), Hole(2.2, 2.9)), openings=(named,), named_openings=True)
    assert kinds(found) == ["door", "opening"]
    assert found.open_pairs == ()
    wide = doors(two_rooms(Hole(0.2, 1.9), Hole(2.2, 2.9)), openings=(named,), named_openings=True)
    assert kinds(wide) == ["door"]
    assert wide.open_pairs == ((0, 1),)


@pytest.mark.parametrize(("named", "found"), [(True, []), (False, ["door"])])
def test_where_the_source_names_its_openings_what_spans_a_whole_room_is_a_beam(named: bool, found: list[str]) -> None:
    corridor = [*shell((0.0, 0.0, 8.2, 2.0)), *wall((4.0, 0.0, 4.2, 2.0), Hole(0.0, 2.0))]
    assert kinds(doors(corridor, named_openings=named)) == found


def test_an_open_front_is_no_entrance() -> None:
    open_house = [*wall((-0.2, -0.2, 0, 4.2)), *wall((0, 4, 5, 4.2)), *wall((5, -0.2, 5.2, 4.2))]
    found = doors(open_house, floor=shapely.box(0, 0, 5, 4))
    assert found.passages == ()
    assert found.notes == {"boundary": "floor_edge"}


@pytest.mark.parametrize("width", [1.8, 3.0])
def test_a_gap_between_two_rooms_that_only_a_guess_closes_is_an_opening(width: float) -> None:
    """A hall with an open front, and in its corner a room of 4 m with a gap beside the end of its wall."""
    hall = [*wall((-0.2, 8.0, 12.2, 8.2)), *wall((-0.2, -0.2, 0.0, 8.0)), *wall((12.0, -0.2, 12.2, 8.0))]
    front = wall((-0.2, -0.2, 12.2, 0.0), gap(4.0, 8.0))
    corner = [*wall((4.0, 4.0, 4.2, 8.0)), *wall((width, 4.0, 4.0, 4.2))]
    spaces = doors([*hall, *front, *corner])
    assert len(spaces.rooms) == 2
    assert [(each.kind, each.closed_by) for each in spaces.passages] == [("opening", "wall_ends")]
    assert doors([*hall, *front, *corner], sills=True).passages == ()


@pytest.mark.parametrize(("level_values", "found"), [({}, 1), ({"named_openings": True}, 0), ({"upper": True}, 0)])
def test_the_open_end_of_a_corridor_is_an_entrance(level_values: dict[str, bool], found: int) -> None:
    """A corridor of 2 m between two rooms of 6 m, with a floor up to its open end; in an upper storey a window."""
    walls = [*wall((-0.2, -0.2, 6.2, 0.0)), *wall((-0.2, 8.0, 6.2, 8.2)), *wall((6.0, 0.0, 6.2, 8.0))]
    walls += [*wall((0.0, 2.9, 6.0, 3.0), gap(2.0, 3.0)), *wall((0.0, 5.0, 6.0, 5.1), gap(2.0, 3.0))]
    walls += [*wall((-0.2, 0.0, 0.0, 3.0)), *wall((-0.2, 5.0, 0.0, 8.0))]
    values = dict(level_values)
    below = shapely.box(20, 0, 24, 4) if values.pop("upper", False) else None
    spaces = doors(walls, floor=shapely.box(-0.2, -0.2, 6.2, 8.2), below=below, **values)
    ways = [each for each in spaces.passages if each.kind == "entrance"]
    assert [(each.closed_by, round(each.width)) for each in ways] == [("floor_edge", 2)] * found


def test_the_stage_alone_needs_a_layout_only() -> None:
    house = level(two_rooms(Hole(1, 1.9)))
    made = stage_values(house)
    layout = made["layout"]
    found = find_doors(house, made["planes"], layout, DoorsConfig())
    np.testing.assert_array_equal([r.area for r in found.rooms], [r.area for r in layout.rooms])


def test_a_trim_that_ends_in_the_air_is_no_door_and_a_lintel_between_crossing_walls_is_one() -> None:
    corner = [box((2.0, 1.9, 4.0, 2.0), 2.1, 2.5), box((1.9, 1.9, 2.0, 3.0), 2.1, 2.5)]  # trims around a stairwell
    found = doors([*shell((0, 0, 4, 3)), *corner])
    assert kinds(found) == []
    assert found.open_pairs == ((0, 1),)
    corridor = [*shell((0, 0, 6, 1.3)), box((3.0, 0.0, 3.1, 1.3), 2.1, 2.5)]
    assert kinds(doors(corridor)) == ["door"]


@pytest.mark.parametrize(
    ("values", "found"),
    [
        ({"floor": shapely.box(0, 0, 7.2, 3)}, ["door", "entrance"]),
        ({"floor": shapely.box(0, 0, 7.2, 3), "below": shapely.box(6, 2, 7, 3)}, ["door"]),
        ({"floor": shapely.box(0, -1.2, 7.2, 3), "below": shapely.box(6, 2, 7, 3)}, ["door", "entrance"]),
        ({"floor": shapely.box(0, 0, 7.2, 3), "below": shapely.box(0, -3, 4, -0.2)}, ["door", "entrance"]),
    ],
    ids=["on the ground", "in an upper storey", "onto a balcony", "to a stair"],
)
def test_an_opening_into_the_air_is_no_entrance(values: dict[str, object], found: list[str]) -> None:
    house = [*shell((0.0, 0.0, 7.2, 3.0), front=(Hole(1.0, 2.4),)), *wall((4.0, 0.0, 4.2, 3.0), Hole(1.0, 1.9))]
    assert sorted(kinds(doors(house, **values))) == found


@pytest.mark.parametrize(
    ("windows", "door", "inner", "entrances"),
    [(2, 2.0, 2.0, 1), (1, 2.0, 2.0, 2), (2, 2.2, 2.0, 2), (2, 2.0, 2.2, 2)],
    ids=["as high as windows", "as one window", "no other way out", "as a door inside"],
)
def test_what_hangs_as_high_as_the_windows_is_no_entrance(
    windows: int, door: float, inner: float, entrances: int
) -> None:
    with_sills = [Hole(start, start + 0.8, 0.9, 2.2) for start in (0.2, 2.8)[:windows]]
    front = [*with_sills, Hole(1.4, 2.4, high=2.2), Hole(5.6, 6.5, high=door)]
    house = [*shell((0.0, 0.0, 7.2, 3.0), front=front), *wall((4.0, 0.0, 4.2, 3.0), Hole(1.0, 1.9, high=inner))]
    found = [each for each in doors(house).passages if each.kind == "entrance"]
    assert len(found) == entrances
    assert max(each.centre[0] for each in found) == pytest.approx(6.05, abs=0.01)


def test_an_opening_as_high_as_the_windows_is_an_entrance_where_a_leaf_stands_beside_it() -> None:
    front = [Hole(start, start + 0.8, 0.9, 2.2) for start in (0.2, 2.8)] + [Hole(1.4, 2.4, high=2.2), Hole(5.6, 6.5)]
    leaf = SourceObject(("door",), box((1.4, 0.0, 1.45, 0.9), 0.0, 2.1))
    one_room = [*shell((0.0, 0.0, 7.2, 3.0), front=front)]
    house = [*one_room, *wall((4.0, 0.0, 4.2, 3.0), Hole(1.0, 1.9))]
    assert sorted(kinds(doors(house))) == ["door", "entrance"]
    assert sorted(kinds(doors(house, leaves=(leaf,)))) == ["door", "entrance", "entrance"]
    assert kinds(doors(one_room)) == ["entrance", "entrance"]  # no door inside says how high doors are here


def test_a_way_out_whose_head_nobody_can_measure_is_no_reason_to_call_another_one_a_window() -> None:
    """Nothing level lies over an opening in a sheet."""
    front = [Hole(0.2, 1.0, 0.9, 2.2), Hole(1.4, 2.4, high=2.2), Hole(2.8, 3.6, 0.9, 2.2)]
    sides = [*wall((-0.2, -0.2, 0.0, 4.0)), *wall((4.0, -0.2, 4.2, 4.0))]
    house = [*wall((-0.2, -0.2, 4.2, 0.0), *front), *sides, *sheet_wall((0.0, 4.0), (4.0, 4.0), Hole(1.0, 1.9))]
    assert kinds(doors(house)) == ["entrance", "entrance"]


@pytest.mark.parametrize(("post", "widths"), [(0.0, [1.6]), (0.2, [0.8, 0.8])])
def test_the_leaves_of_one_door_are_one_passage(post: float, widths: list[float]) -> None:
    low, high = (1.0, 1.8), (1.8 + post, 2.6 + post)
    leaves = tuple(Opening.named(shapely.box(4.0, a, 4.2, b), has_door=True) for a, b in (low, high))
    found = doors(two_rooms(Hole(1.0, 1.8), Hole(1.8 + post, 2.6 + post)), openings=leaves).passages
    assert [each.width for each in found] == pytest.approx(widths, abs=0.01)
