"""Stage connectivity: everything can be reached, by cuts where they have to be."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import shapely

from houseexpo.analysis.graph import shortest_path
from pipeline.config import ConnectivityConfig
from pipeline.geometry.areas import EMPTY, unite
from pipeline.geometry.rooms_and_passages import erode_floor, walkable_floor
from pipeline.rejection import Reason, Rejection
from pipeline.stages.connectivity import NO_EVIDENCE, UNKNOWN, connect_rooms
from pipeline.values import Evidence, Opening, Spaces
from tests.builders.houses import Hole, gap, kinds, level, shell, stage_values, three_rooms, two_rooms, wall
from tests.builders.tries import slow_but

CONFIG = ConnectivityConfig()


def connected(
    spaces: Spaces,
    config: ConnectivityConfig = CONFIG,
    seed: int = 0,
    evidence: Evidence | None = None,
    unlikely: shapely.Geometry = EMPTY,
    cells: shapely.Geometry = EMPTY,
) -> Spaces:
    return connect_rooms(spaces, config, 2.0, np.random.default_rng(seed), evidence, unlikely=unlikely, cells=cells)


def seen(**places) -> Evidence:
    """Evidence of nothing but these."""
    nothing = shapely.Polygon()
    return replace(Evidence(nothing, nothing, nothing, nothing, nothing), **places)


def before(parts: list) -> Spaces:
    return stage_values(level(parts))["isolated"]


def drawn(walls: shapely.Geometry, *rooms: shapely.Polygon) -> Spaces:
    return Spaces(walls, rooms, ())


def test_a_house_that_is_connected_stays_the_same_value() -> None:
    spaces = before(two_rooms(Hole(1, 1.9)))
    assert connected(spaces) is spaces


def test_where_a_storey_shows_no_door_each_cut_stands_for_an_unknown_one() -> None:
    found = connected(before(three_rooms()), evidence=seen())
    assert [(passage.kind, passage.why) for passage in found.passages] == [("cut", UNKNOWN)] * 2
    assert found.notes == {"cuts": 2, "doors_unknown": 1}


def test_an_entrance_says_nothing_of_the_doors_inside() -> None:
    front = [*shell((0.0, 0.0, 7.2, 3.0), front=[Hole(1.0, 1.9)]), *wall((4.0, 0.0, 4.2, 3.0))]
    stages = stage_values(level(front))
    found = connected(stages["isolated"], evidence=stages["evidence"])
    assert sorted((passage.kind, passage.why) for passage in found.passages) == [("cut", UNKNOWN), ("entrance", "")]


def test_where_a_storey_shows_a_door_a_cut_stands_for_none() -> None:
    found = connected(before(three_rooms([Hole(1.0, 1.9)])), evidence=seen())
    assert [passage.why for passage in found.passages if passage.kind == "cut"] == [NO_EVIDENCE]
    assert "doors_unknown" not in found.notes


LAST_ROOM = shapely.box(6.3, 0, 9.3, 3)


def test_a_closed_space_that_is_likely_no_room_is_left_out_and_told() -> None:
    found = connected(before(three_rooms([Hole(1.0, 1.9)])), evidence=seen(), unlikely=LAST_ROOM)
    assert kinds(found) == ["door"]
    assert len(found.rooms) == 2
    (closed,) = found.closed
    assert closed.bounds == pytest.approx(LAST_ROOM.bounds, abs=1e-3)
    assert found.notes == {"closed_spaces": 1}


def test_a_closed_cell_is_left_out_where_doors_are_unknown_too() -> None:
    gaps = [gap(1.0, 1.9)]  # a way, but no door
    found = connected(before(three_rooms(gaps)), evidence=seen(), cells=LAST_ROOM)
    assert kinds(found) == ["opening"]
    assert (len(found.rooms), len(found.closed)) == (2, 1)
    assert "doors_unknown" not in found.notes


def test_a_closed_cell_between_two_parts_is_their_way() -> None:
    middle = shapely.box(3.1, 0, 6.1, 3)
    found = connected(before(three_rooms()), evidence=seen(), cells=middle)
    assert (len(found.rooms), kinds(found), found.closed) == (3, ["cut", "cut"], ())
    found = connected(before(three_rooms()), evidence=seen(), cells=shapely.box(0, 0, 3, 3))
    assert (len(found.rooms), kinds(found), len(found.closed)) == (2, ["cut"], 1)


def test_no_cut_leads_into_a_closed_cell_before_all_others_are_joined() -> None:
    """The walls of the cell are 0.1 m thick, and the one between the two others 0.4 m."""
    rooms = [shapely.box(0, 0, 3, 4), shapely.box(3.4, 2.1, 6, 4), shapely.box(3.1, 0, 6, 2)]
    house = drawn(shapely.box(-0.2, -0.2, 6.2, 4.2).difference(unite(rooms)), *rooms)
    found = connected(house, evidence=seen(), cells=rooms[2])
    assert (len(found.rooms), kinds(found), len(found.closed)) == (2, ["cut"], 1)
    assert len(connected(house, evidence=seen()).passages) == 2


@pytest.mark.parametrize(
    ("parts", "evidence"),
    [
        (three_rooms(), seen()),  # no door is shown at all
        (three_rooms([Hole(1.0, 1.9)]), seen(leaves=(shapely.box(6.3, 1.0, 7.1, 1.04),))),  # a leaf beside the wall
        (three_rooms([Hole(1.0, 1.9)]), None),
    ],
    ids=["doors unknown", "leaf", "no evidence"],
)
def test_a_space_with_evidence_of_a_door_is_no_closed_one(parts: list, evidence: Evidence | None) -> None:
    unlikely = LAST_ROOM if evidence else shapely.box(6.3, 0, 7.3, 3)  # a third of the room
    found = connected(before(parts), evidence=evidence or seen(), unlikely=unlikely)
    assert len(found.rooms) == 3
    assert found.closed == ()


def test_a_closed_space_with_an_entrance_of_its_own_is_joined_by_a_cut() -> None:
    front = [*shell((0.0, 0.0, 9.3, 3.0), front=[Hole(7.0, 7.9)]), *three_rooms([Hole(1.0, 1.9)])[4:]]
    found = connected(before(front), evidence=seen(), unlikely=LAST_ROOM)
    assert kinds(found) == ["cut", "door", "entrance"]


@pytest.mark.parametrize("seed", range(4))
def test_a_cut_is_a_door_through_the_wall(seed: int) -> None:
    found = connected(before(two_rooms()), seed=seed)
    (cut,) = found.passages
    assert cut.kind == "cut"
    assert set(cut.sides) == {0, 1}
    assert (cut.width, cut.depth) == (0.8, pytest.approx(0.2, abs=1e-3))
    assert abs(cut.along[0]) < 1e-9
    assert cut.centre[0] == pytest.approx(4.1, abs=1e-3)
    assert 0.4 <= cut.centre[1] <= 2.6
    assert found.notes["cuts"] == 1


AT_THE_WALL = shapely.box(4.08, 1.7, 4.12, 2.5)
AJAR = shapely.box(4.2, 1.7, 5.0, 1.74)


@pytest.mark.parametrize(
    ("evidence", "why"),
    [
        (seen(leaves=(AT_THE_WALL,)), "the leaf of a door"),
        (seen(leaves=(AJAR,)), "the leaf of a door"),
        (seen(lintels=AT_THE_WALL), "a lintel"),
        (seen(doorways=(Opening.named(AT_THE_WALL, has_door=True),)), "a doorway that nothing else leads through"),
        (seen(leaves=(AT_THE_WALL,), lintels=shapely.box(4, 0.3, 4.2, 1.2)), "the leaf of a door"),
    ],
    ids=["leaf", "leaf ajar", "lintel", "doorway", "a leaf before a lintel"],
)
@pytest.mark.parametrize("seed", range(3))
def test_a_cut_prefers_a_place_with_evidence_and_says_so(evidence: Evidence, why: str, seed: int) -> None:
    (cut,) = connected(before(two_rooms()), seed=seed, evidence=evidence).passages
    assert cut.why == why
    assert cut.centre[0] == pytest.approx(4.1, abs=1e-3)
    assert cut.centre[1] == pytest.approx(2.1, abs=0.6)


@pytest.mark.parametrize(
    "evidence",
    [
        None,
        seen(leaves=(shapely.box(1.0, -0.12, 1.8, -0.08),)),  # in the outer wall
        seen(leaves=(shapely.box(1.0, 1.0, 1.8, 1.04),)),  # in the middle of a room
        seen(leaves=(shapely.box(4.08, 1.7, 4.12, 2.0),)),  # too small for a door
    ],
    ids=["none", "outer wall", "loose", "small"],
)
def test_evidence_elsewhere_moves_no_cut(evidence: Evidence | None) -> None:
    (bare,) = connected(before(two_rooms())).passages
    (cut,) = connected(before(two_rooms()), evidence=evidence).passages
    assert cut.why == NO_EVIDENCE
    np.testing.assert_allclose(cut.segment, bare.segment)


def test_the_pair_of_a_cut_has_a_path_that_goes_through_it() -> None:
    found = connected(before(two_rooms()))
    (pair,) = found.joined
    way = shortest_path(walkable_floor(found).buffer(-pair.radius_m), *pair.points)
    line = shapely.linestrings(way.points)
    assert line.intersects(found.passages[0].strip())
    assert walkable_floor(found).covers(line.buffer(CONFIG.robot_radius_m - 0.05))


def test_three_closed_rooms_need_two_cuts_and_no_more() -> None:
    found = connected(before(three_rooms()))
    assert kinds(found) == ["cut", "cut"]
    assert len(erode_floor(walkable_floor(found), CONFIG.robot_radius_m)) == 1
    assert sorted(round(p.depth, 2) for p in found.passages) == [0.1, 0.2]


def test_a_room_that_can_be_reached_is_not_cut_a_second_time() -> None:
    found = connected(before(three_rooms([Hole(1, 1.9)])))
    assert kinds(found) == ["cut", "door"]
    cut = next(p for p in found.passages if p.kind == "cut")
    assert cut.centre[0] == pytest.approx(6.2, abs=1e-3)


def test_a_door_too_narrow_for_the_robot_is_no_way() -> None:
    spaces = before(two_rooms(Hole(1, 1.5)))
    assert kinds(connected(spaces)) == ["door"]
    wide = ConnectivityConfig(robot_radius_m=0.3)
    assert kinds(connected(spaces, wide)) == ["cut", "door"]


def test_cuts_are_as_wide_as_asked_for() -> None:
    found = connected(before(two_rooms()), ConnectivityConfig(cut_width_m=1.0))
    assert found.passages[0].width == 1.0


@pytest.mark.parametrize("gap_m", slow_but([0.3, 1.0, 1.9], 1.0))
def test_no_cut_leads_through_the_open(gap_m: float) -> None:
    """Two parts apart, and the two arms of a U whose third side is too thick to be cut."""
    far = 4.2 + gap_m
    one, other = shapely.box(0, 0, 4, 3), shapely.box(far + 0.2, 0, far + 4, 3)
    around = unite([shapely.box(-0.2, -0.2, 4.2, 3.2), shapely.box(far, -0.2, far + 4.2, 3.2)])
    for walls in (around, unite([around, shapely.box(-0.2, -3.0, far + 4.2, -0.2)])):
        found = connected(drawn(walls.difference(unite([one, other])), one, other))
        assert (kinds(found), len(found.rooms)) == ([], 1)
        assert found.notes == {"left_out": 1}


def test_no_cut_leads_through_a_court() -> None:
    one, other = shapely.box(0, 0, 4, 3), shapely.box(6.4, 0, 10.4, 3)
    court = shapely.box(4.2, 0, 6.2, 3)
    walls = shapely.box(-0.2, -0.2, 10.6, 3.2).difference(unite([one, court, other]))
    assert kinds(connected(drawn(walls, one, other))) == []


@pytest.mark.parametrize(
    "between", [shapely.box(4.2, 0, 4.35, 3.3), shapely.box(4.2, 1, 5.2, 2.9)], ids=["a joint", "a filled cell"]
)
def test_a_cut_leads_through_what_is_as_good_as_wall(between: shapely.Geometry) -> None:
    far = between.bounds[2] + 0.2
    one, other = shapely.box(0, 0, 4, 3), shapely.box(far, 0, far + 4, 3)
    walls = shapely.box(-0.2, -0.2, far + 4.2, 3.2).difference(unite([one, other, between]))
    (cut,) = connected(drawn(walls, one, other)).passages
    assert cut.depth == pytest.approx(far - 4.0, abs=0.01)


def test_a_pinch_inside_a_room_is_widened_and_makes_no_door() -> None:
    room = shapely.box(0, 0, 8, 3).difference(unite([shapely.box(3.9, 0, 4.1, 1.3), shapely.box(3.9, 1.6, 4.1, 3)]))
    walls = shapely.box(-0.2, -0.2, 8.2, 3.2).difference(room)
    found = connected(drawn(walls, room))
    assert found.passages == ()
    assert len(erode_floor(walkable_floor(found), CONFIG.robot_radius_m)) == 1
    assert found.rooms[0].area > room.area


def test_a_pocket_that_nobody_gets_into_is_filled() -> None:
    """A corner of 0.9 m x 0.9 m behind a slit of 0.3 m."""
    shelf = unite([shapely.box(0.9, 0, 1.0, 0.6), shapely.box(0, 0.9, 1.0, 1.0)])
    room = shapely.box(0, 0, 5, 4).difference(shelf)
    walls = shapely.box(-0.2, -0.2, 5.2, 4.2).difference(room)
    found = connected(drawn(walls, room))
    assert found.notes["filled_pockets"] == 1
    assert "cuts" not in found.notes
    assert found.rooms[0].area == pytest.approx(19.0, abs=0.25)
    assert len(erode_floor(walkable_floor(found), CONFIG.robot_radius_m)) == 1


def test_a_pocket_is_filled_in_the_smaller_room_of_a_house_too() -> None:
    """The way through both rooms is one piece, whose middle lies in the larger one."""
    rooms = before(two_rooms(Hole(1, 1.9)))
    shelf = unite([shapely.box(6.2, 0, 6.3, 0.6), shapely.box(6.2, 0.9, 7.2, 1.0)])
    spaces = replace(rooms, rooms=tuple(shapely.difference(room, shelf) for room in rooms.rooms))
    found = connected(spaces)
    assert found.notes["filled_pockets"] == 1
    assert kinds(found) == ["door"]


def test_a_wall_on_the_way_between_two_walls_is_cut_at_right_angles() -> None:
    oblique = shapely.affinity.rotate(shapely.box(3.95, -2, 4.05, 6), 20)
    room = shapely.box(0, 0, 8, 4)
    left, right = sorted(room.difference(oblique).geoms, key=lambda p: p.bounds)
    walls = unite([shapely.box(-0.2, -0.2, 8.2, 4.2).difference(room), room.intersection(oblique)])
    (cut,) = connected(drawn(walls, left, right)).passages
    assert abs(cut.along @ [-np.sin(np.deg2rad(20)), np.cos(np.deg2rad(20))]) == pytest.approx(1, abs=1e-6)
    assert cut.depth == pytest.approx(0.1, abs=1e-6)


def test_rooms_too_small_for_a_robot_are_rejected() -> None:
    with pytest.raises(Rejection) as caught:
        connected(before(two_rooms()), ConnectivityConfig(robot_radius_m=1.6))
    assert (caught.value.stage, caught.value.reason) == ("connectivity", Reason.NO_ROOM_FITS)


def test_rooms_in_which_nothing_is_left_to_stand_are_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    """As where the last piece is a few square centimetres, and goes with a pocket beside it."""
    bare = replace(before(two_rooms()), rooms=(shapely.box(0, 0, 0.3, 4), shapely.box(5, 0, 5.3, 4)))
    monkeypatch.setattr("pipeline.stages.connectivity._without_pockets", lambda *_: bare)
    with pytest.raises(Rejection, match="can stand nowhere in 2 rooms"):
        connected(before(two_rooms()))


def test_a_seed_gives_the_same_cuts() -> None:
    first, second = (connected(before(three_rooms()), seed=9) for _ in range(2))
    for one, other in zip(first.passages, second.passages, strict=True):
        np.testing.assert_array_equal(one.segment, other.segment)


@pytest.mark.slow
def test_no_plan_loads_numba_be_there_a_cut_or_none() -> None:
    code = (
        "import sys; from tests.builders.houses import *; "
        "plan_of(two_rooms(Hole(1, 1.9))); plan_of(two_rooms()); assert 'numba' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_wing_of_several_rooms_is_cut_into_once() -> None:
    wing = [*wall((5.0, 0, 5.1, 6)), *wall((5.1, 3.0, 9, 3.1), Hole(6, 6.9))]
    found = connected(before([*shell((0, 0, 9, 6)), *wing]))
    assert kinds(found) == ["cut", "door"]
