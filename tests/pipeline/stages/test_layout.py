"""Stage layout: what closes the door plane, and what is no house."""

import numpy as np
import pytest
import shapely

from pipeline.config import EvidenceConfig, LayoutConfig, PlanesConfig
from pipeline.geometry.areas import OUTSIDE
from pipeline.rejection import Reason, Rejection
from pipeline.stages.evidence import gather_evidence
from pipeline.stages.layout import close_openings
from pipeline.stages.planes import find_planes
from pipeline.values import Layout, Opening, SourceObject, SourceRoom
from tests.builders.houses import Hole, Parts, gap, level, shell, three_rooms, two_rooms, wall, window
from tests.builders.meshes import box, joined, sheet


def layout(parts: Parts, config: LayoutConfig | None = None, **values: object) -> Layout:
    house = level(parts, **values)
    evidence = gather_evidence(house, EvidenceConfig())
    return close_openings(house, evidence, find_planes(house, evidence, PlanesConfig()), config or LayoutConfig())


def areas(found: Layout) -> list[float]:
    return [round(room.area, 1) for room in found.rooms]


def test_a_lintel_parts_two_rooms() -> None:
    found = layout(two_rooms(Hole(1.0, 1.9)))
    assert areas(found) == [12.0, 9.0]
    (candidate,) = found.candidates
    assert candidate.closed_by == "lintel"
    assert candidate.is_strip
    assert set(candidate.sides) == {0, 1}


def test_an_outer_door_leads_outside() -> None:
    found = layout(shell((0, 0, 5, 4), front=[Hole(1, 2)]))
    (candidate,) = found.candidates
    assert candidate.is_strip
    assert set(candidate.sides) == {0, OUTSIDE}


@pytest.mark.parametrize("named", [True, False])
def test_a_beam_along_a_wall_does_not_close_its_doors_where_they_are_named(named: bool) -> None:
    """Beams of 0.2 m hang from the ceiling on both sides of the wall, from end to end."""
    beams = [box((4.2, 0.0, 4.4, 3.0), 2.3, 2.5), box((3.8, 0.0, 4.0, 3.0), 2.3, 2.5)]
    door = Opening.named(shapely.box(4.0, 1.0, 4.2, 1.9), has_door=True)
    found = layout([*two_rooms(Hole(1.0, 1.9)), *beams], openings=(door,), named_openings=named)
    doors = [c for c in found.candidates if c.closed_by == "door"]
    assert [set(opening.sides) for opening in doors if opening is not None] == ([{0, 1}] if named else [])


def test_a_beam_along_a_wall_does_not_close_the_doorway_of_a_leaf_that_is_named() -> None:
    beams = [box((4.2, 0.0, 4.4, 3.0), 2.1, 2.5), box((3.8, 0.0, 4.0, 3.0), 2.1, 2.5)]
    leaf = SourceObject(("Door",), joined([box((4.08, 1.0, 4.12, 1.9), 0.0, 2.1)]))
    found = layout([*two_rooms(Hole(1.0, 1.9)), *beams], leaves=(leaf,))
    doors = [c for c in found.candidates if c.closed_by == "door"]
    assert [set(opening.sides) for opening in doors if opening is not None] == [{0, 1}]


@pytest.mark.parametrize(("width", "widest", "rooms"), [(0.9, 1.5, 2), (1.45, 1.5, 2), (2.1, 1.5, 1), (2.1, 2.5, 2)])
def test_a_gap_of_full_height_parts_up_to_a_width(width: float, widest: float, rooms: int) -> None:
    found = layout(two_rooms(gap(0.5, 0.5 + width)), LayoutConfig(gap_m=widest))
    assert len(found.rooms) == rooms
    assert [c.closed_by for c in found.candidates] == ["gap"] * (rooms - 1)


@pytest.mark.parametrize("step", [0.0, 0.015, 0.2])
def test_a_gap_parts_where_one_sheet_of_its_wall_ends_before_the_other(step: float) -> None:
    """A wall of two leaves with a gap of 0.9 m."""
    leaves = [*wall((4.0, 0.0, 4.1, 3.0), gap(1.0 - step, 1.9)), *wall((4.1, 0.0, 4.2, 3.0), gap(1.0, 1.9 + step))]
    found = layout([*shell((0.0, 0.0, 7.2, 3.0)), *leaves])
    assert areas(found) == [12.0, 9.0]
    assert {candidate.closed_by for candidate in found.candidates} == {"gap"}


@pytest.mark.parametrize(("breadth", "rooms"), [(6.0, 2), (3.8, 2), (3.2, 1)])
def test_a_wide_gap_parts_two_rooms_that_are_much_broader(breadth: float, rooms: int) -> None:
    """2.2 m wide, between two ends of a wall."""
    between = wall((4.0, 0.0, 4.2, breadth), gap(0.8, 3.0))
    found = layout([*shell((0.0, 0.0, 8.2, breadth)), *between])
    assert len(found.rooms) == rooms
    assert [candidate.closed_by for candidate in found.candidates] == ["mouth"] * (rooms - 1)


@pytest.mark.parametrize("apart", [0.0, 0.2])
@pytest.mark.parametrize(("low", "high", "rooms"), [(0.8, 2.8, 2), (0.0, 2.0, 2), (0.0, 3.0, 1)])
def test_rooms_that_the_source_draws_meet_in_an_opening_at_the_end_of_a_wall(
    apart: float, low: float, high: float, rooms: int
) -> None:
    """A gap of 2 m in the wall between them; where no wall stands between them, they stay one space."""
    drawn = [
        SourceRoom((name,), (), shapely.box(x1, 0.0, x2, 3.0))
        for name, x1, x2 in (("Kitchen", 0.0, 4.1 - apart / 2), ("Living", 4.1 + apart / 2, 8.2))
    ]
    spans = [(a, b) for a, b in ((0.0, low), (high, 3.0)) if b > a]
    between = [box((4.0, a, 4.2, b), 0.0, 2.5) for a, b in spans]
    found = layout([*shell((0.0, 0.0, 8.2, 3.0)), *between], rooms=tuple(drawn))
    assert len(found.rooms) == rooms
    assert [candidate.closed_by for candidate in found.candidates] == ["opening"] * (rooms - 1)


def test_a_border_that_parts_nothing_stays_open() -> None:
    """Two named rooms that also meet around the wall between them, in a third place that nobody named."""
    drawn = [
        SourceRoom((name,), (), shapely.box(x1, 0.0, x2, 3.0)) for name, x1, x2 in (("A", 0, 4.1), ("B", 4.1, 8.2))
    ]
    found = layout([*shell((0.0, 0.0, 8.2, 6.0)), box((4.0, 0.0, 4.2, 1.0), 0.0, 2.5)], rooms=tuple(drawn))
    assert len(found.rooms) == 1


def _hall_and_chamber(neck_m: float) -> list[object]:
    """A hall of 6 m x 6 m, a neck as wide as this and 2 m long between two blocks, and a chamber of 4 m x 6 m."""
    low, high = 3.0 - neck_m / 2, 3.0 + neck_m / 2
    blocks = [box((6.0, 0.0, 8.0, low), 0.0, 2.5), box((6.0, high, 8.0, 6.0), 0.0, 2.5)]
    return [*shell((0.0, 0.0, 12.0, 6.0)), *blocks]


@pytest.mark.parametrize(("neck_m", "rooms"), [(2.4, 2), (4.4, 1)])
def test_a_neck_parts_a_hall_from_its_chamber(neck_m: float, rooms: int) -> None:
    found = layout(_hall_and_chamber(neck_m))
    assert len(found.rooms) == rooms
    if rooms == 2:
        assert sum(room.area for room in found.rooms) == pytest.approx(60.0 + 2.0 * neck_m - 0.2 * neck_m, abs=0.1)


@pytest.mark.parametrize(("deep_m", "rooms"), [(1.5, 2), (3.2, 1)])
def test_a_mouth_between_blocks_that_is_much_wider_than_deep_parts_rooms_not_much_deeper_than_it(
    deep_m: float, rooms: int
) -> None:
    """Two halls of 10 m x 6 m and 6 m between their blocks: no disc of 9 m fits in, as none does in a corridor."""
    blocks = [box((x, 6.0, x + 2.0, 6.0 + deep_m), 0.0, 2.5) for x in (0.0, 8.0)]
    found = layout([*shell((0.0, 0.0, 10.0, 12.0 + deep_m)), *blocks])
    assert len(found.rooms) == rooms


@pytest.mark.parametrize(("deep_m", "rooms"), [(5.0, 2), (6.0, 1)])
def test_a_mouth_between_deep_blocks_is_no_deeper_than_wide(deep_m: float, rooms: int) -> None:
    """Two halls of 16 m x 16 m, joined by what is 5 m wide; where that is deeper, it is a corridor."""
    blocks = [box((16.0, y, 16.0 + deep_m, y + 5.5), 0.0, 2.5) for y in (0.0, 10.5)]
    found = layout([*shell((0.0, 0.0, 32.0 + deep_m, 16.0)), *blocks])
    assert len(found.rooms) == rooms


def test_two_wide_openings_of_one_wall_part_rooms_together() -> None:
    between = wall((5.0, 0.0, 5.2, 10.0), gap(1.0, 3.2), gap(6.5, 8.9))
    found = layout([*shell((0.0, 0.0, 10.2, 10.0)), *between])
    assert areas(found) == [50.0, 50.0]
    assert [candidate.closed_by for candidate in found.candidates] == ["mouth", "mouth"]


@pytest.mark.parametrize("named", [True, False])
def test_a_door_beside_a_wide_opening_parts_rooms_with_it(named: bool) -> None:
    """Both together would take two thirds of the breadth; the opening alone takes half."""
    between = wall((5.0, 0.0, 5.2, 5.0), gap(0.5, 3.0), gap(3.6, 4.5))
    door = Opening.named(shapely.box(5.0, 3.6, 5.2, 4.5), has_door=True)
    other = Opening.named(shapely.box(-0.2, 1.0, 0.0, 1.9), has_door=True)
    openings = (door, other) if named else (other,)
    found = layout([*shell((0.0, 0.0, 10.2, 5.0)), *between], openings=openings, unnamed_gaps=True)
    assert len(found.rooms) == (2 if named else 1)


@pytest.mark.parametrize(("other", "rooms"), [(Hole(3.6, 4.5), 2), (gap(3.6, 4.5), 1)])
def test_a_lintel_beside_a_wide_opening_parts_rooms_with_it(other: Hole, rooms: int) -> None:
    between = wall((5.0, 0.0, 5.2, 5.0), gap(0.5, 3.0), other)
    assert len(layout([*shell((0.0, 0.0, 10.2, 5.0)), *between]).rooms) == rooms


@pytest.mark.parametrize(("width_m", "rooms"), [(0.9, 2), (1.8, 1)])
def test_a_gap_in_another_wall_parts_a_side_room_beside_a_wide_opening(width_m: float, rooms: int) -> None:
    """A chamber in the corner of a hall, with a wide opening in one wall and another way in the next."""
    corner = [*wall((0.0, 4.0, 4.2, 4.2), gap(1.0, 1.0 + width_m)), *wall((4.0, 0.0, 4.2, 4.0), gap(1.0, 2.8))]
    found = layout([*shell((0.0, 0.0, 12.0, 12.0)), *corner])
    assert len(found.rooms) == rooms
    assert sorted(candidate.closed_by for candidate in found.candidates) == ["gap", "mouth"][: 2 * (rooms - 1)]


def test_a_crack_beside_a_wide_opening_closes_with_it() -> None:
    """The wall before a chamber ends 3 cm before the outer wall."""
    corner = [*wall((0.03, 4.0, 4.2, 4.2)), *wall((4.0, 0.0, 4.2, 4.0), gap(1.0, 2.8))]
    assert len(layout([*shell((0.0, 0.0, 12.0, 12.0)), *corner]).rooms) == 2


@pytest.mark.parametrize(("aside_m", "rooms"), [(0.1, 2), (0.25, 1)])
def test_a_wall_that_ends_a_little_beside_where_another_points_ends_the_mouth(aside_m: float, rooms: int) -> None:
    """A bay of 4 m x 3 m: the wall before it ends 1.8 m before the wall beside it, which ends short of its line."""
    before, beside = wall((0.0, 3.0, 2.0, 3.2)), wall((3.8, 0.0, 4.0, 3.0 - aside_m))
    found = layout([*shell((0.0, 0.0, 10.0, 6.0)), *before, *beside])
    assert len(found.rooms) == rooms


def test_a_corridor_and_its_bend_have_no_mouth() -> None:
    """A corridor 2 m wide that leads off a hall and bends: one room, as nothing narrows."""
    blocks = [box((6.0, 0.0, 10.0, 2.0), 0.0, 2.5), box((6.0, 4.0, 8.0, 8.0), 0.0, 2.5)]
    assert len(layout([*shell((0.0, 0.0, 10.0, 8.0)), *blocks]).rooms) == 1


@pytest.mark.parametrize("only_walls", [True, False])
def test_one_room_of_the_source_has_no_mouth_where_the_source_names_its_walls(only_walls: bool) -> None:
    """R1: elsewhere it may be the floor of the storey."""
    named = (SourceRoom(("Hall",), (), shapely.box(0, 0, 12, 6)),)
    found = layout(_hall_and_chamber(2.4), rooms=named, only_walls=only_walls)
    assert len(found.rooms) == (1 if only_walls else 2)


def test_a_floor_called_room_that_reaches_before_the_house_is_no_room_there() -> None:
    """R1: a room of 5 m x 4 m with an opening of 3.4 m, and a floor that goes on 1 m before it."""
    parts = shell((0.0, 0.0, 5.0, 4.0), front=[gap(0.8, 4.2)])
    floor = shapely.box(0.0, -1.2, 5.0, 4.0)
    named = (SourceRoom(("Room",), (), floor),)
    areas = {
        only_walls: round(sum(room.area for room in layout(parts, rooms=named, only_walls=only_walls).rooms))
        for only_walls in (True, False)
    }
    assert areas == {True: 26, False: 20}


def test_a_room_beside_a_floor_called_room_is_one_room() -> None:
    """R1: the hall is all that the source draws but the storey, and no storey itself."""
    parts = [*_hall_and_chamber(2.4), *shell((0.0, 6.2, 12.0, 10.2))]
    storey, hall = shapely.box(0, 0, 12, 10.2), shapely.box(0, 0, 12, 6)
    found = layout(
        parts, rooms=tuple(SourceRoom((name,), (), area) for name, area in (("Room", storey), ("Hall", hall)))
    )
    assert len(found.rooms) == 2


def test_a_room_of_the_source_that_nothing_else_closes_closes_at_its_edge() -> None:
    """R1: walls on two sides, which close nothing."""
    parts = [*wall((-0.2, -0.2, 6.0, 0.0)), *wall((-0.2, 0.0, 0.0, 5.0))]
    named = (SourceRoom(("Room",), (), shapely.box(0.0, 0.0, 6.0, 5.0)),)
    assert [round(room.area) for room in layout(parts, rooms=named).rooms] == [30]


@pytest.mark.parametrize(
    ("drawn", "rooms"),
    [
        ([(0, 0, 7.2, 3)], 1),
        ([(0, 0, 4.1, 3), (4.1, 0, 7.2, 3)], 2),
        ([(0, 0, 4.25, 3), (4.25, 0, 7.2, 3)], 2),  # the floor of one reaches under the wall, past its other face
    ],
)
def test_a_gap_within_one_room_of_the_source_parts_nothing(
    drawn: list[tuple[float, float, float, float]], rooms: int
) -> None:
    named = tuple(SourceRoom(("Hall",), (), shapely.box(*box)) for box in drawn)
    found = layout(two_rooms(gap(0.7, 1.6)), rooms=named, only_walls=True)
    assert len(found.rooms) == rooms


@pytest.mark.parametrize(
    ("depth", "nibs", "rooms"), [(1.4, (0.05, 0.05), 1), (1.4, (0.1, 0.2), 2), (0.7, (0.1, 0.2), 1)]
)
def test_a_gap_that_parts_off_a_niche_is_none_but_of_a_closet(
    depth: float, nibs: tuple[float, float], rooms: int
) -> None:
    """A niche 1 m wide: as wide as its gap, wider as closets are, and wider but too small to step in."""
    found = layout(
        [
            *shell((0, 0, 5, 4)),
            *wall((0, 1.0, depth + 0.1, 1.1)),
            *wall((depth, 1.0 - nibs[0], depth + 0.1, 1.1), foot=0),
            *wall((depth, 0.0, depth + 0.1, nibs[1])),
        ]
    )
    assert len(found.rooms) == rooms


@pytest.mark.parametrize(
    "thing",
    [
        box((0, 0, 0.35, 3), 1.4, 2.2),  # a wall cabinet
        box((1, 0, 1.35, 1.6), 1.4, 2.5),  # a cupboard that hangs from the ceiling
        box((0, 1.4, 4, 1.5), 2.3, 2.5),  # a beam against both walls
    ],
    ids=["cabinet", "cupboard", "beam of 4 m"],
)
def test_what_hangs_in_a_room_parts_nothing(thing: object) -> None:
    found = layout([*shell((0, 0, 4.4, 3)), thing])
    assert areas(found) == [13.2]
    assert found.candidates == ()


def test_a_long_lintel_between_wall_stubs_is_one() -> None:
    stubs = wall((4, 0, 4.2, 5.4), Hole(0.5, 4.9))
    assert len(layout([*shell((0, 0, 8, 5.4)), *stubs]).rooms) == 2


@pytest.mark.parametrize(("beyond", "rooms"), [(5.4, 1), (9.0, 2)])
def test_a_beam_between_pillars_parts_rooms_only_where_one_is_broader(beyond: float, rooms: int) -> None:
    """A beam over 4.8 m between pillars of 0.3 m; the room behind it is as broad as the first, or broader."""
    outline = [(-0.2, -0.2, 0.0, 5.6), (0.0, -0.2, 8.2, 0.0), (0.0, 5.4, 4.2, 5.6)]
    outline += [(4.0, 5.4, 4.2, beyond + 0.2), (4.2, beyond, 8.2, beyond + 0.2), (8.2, -0.2, 8.4, beyond + 0.2)]
    house = [part for rectangle in outline for part in wall(rectangle)]
    found = layout([*house, *wall((4.0, 0.0, 4.2, 5.4), Hole(0.3, 5.1))])
    assert len(found.rooms) == rooms


@pytest.mark.parametrize(("pier_m", "rooms"), [(0.4, 1), (1.0, 2)])
def test_a_beam_over_a_row_of_pillars_parts_no_hall(pier_m: float, rooms: int) -> None:
    """Three bays of 2.8 m and more, none of them as wide as a beam; between broader piers they are doorways."""
    bays = [Hole(0.3, 3.3 - pier_m / 2), Hole(3.3 + pier_m / 2, 6.7 - pier_m / 2), Hole(6.7 + pier_m / 2, 9.7)]
    assert len(layout([*shell((0, 0, 12, 10)), *wall((6.0, 0.0, 6.4, 10.0), *bays)]).rooms) == rooms


def parapet(height: float, x: float = 4.0) -> Parts:
    """Walls of a balcony below the house: 4 x 1.6 m."""
    return [
        *wall((-0.2, -1.8, 0, -0.2), top=height),
        *wall((x, -1.8, x + 0.2, -0.2), top=height),
        *wall((-0.2, -2, x + 0.2, -1.8), top=height),
    ]


@pytest.mark.parametrize("height", [0.9, 1.1])
def test_a_balcony_with_a_parapet_is_a_room_with_a_door(height: float) -> None:
    found = layout([*shell((0, 0, 4, 3), front=[Hole(1, 1.9)]), *parapet(height)])
    assert areas(found) == [12.0, 6.4]
    assert [set(c.sides) for c in found.candidates if c.is_strip] == [{0, 1}]


@pytest.mark.parametrize(("roof", "name", "rooms"), [(-0.2, "", 1), (-2.0, "", 2), (-0.2, "Balcony", 2)])
def test_a_balcony_under_the_sky_is_no_room_of_a_roofed_house(roof: float, name: str, rooms: int) -> None:
    """Unless the roof reaches over it, or the source names it."""
    drawn = (SourceRoom((name,), (name,), shapely.box(0.0, -1.8, 4.0, -0.2)),) if name else ()
    house = [*shell((0, 0, 4, 3), front=[Hole(1, 1.9)]), box((-0.2, roof, 4.2, 3.2), 2.5, 2.7)]
    found = layout([*house, *parapet(1.0)], rooms=drawn)
    assert areas(found) == [12.0, 6.4][:rooms]
    assert [set(c.sides) for c in found.candidates if c.is_strip] == [{0, 1} if rooms == 2 else {0, OUTSIDE}]


@pytest.mark.parametrize("rail", [0.04, 0.1])
def test_a_railing_closes_a_balcony_that_its_balusters_do_not(rail: float) -> None:
    across = [(x, -1.8, x + 0.03, -1.77) for x in np.arange(-0.2, 4.1, 0.12)]
    sides = [(x, y, x + 0.03, y + 0.03) for x in (-0.2, 4.17) for y in np.arange(-1.65, -0.2, 0.12)]
    handrail = [(-0.2, -1.8, 4.2, -1.75), (-0.2, -1.8, -0.15, -0.2), (4.15, -1.8, 4.2, -0.2)]
    balcony = [box(r, 0, 1.0) for r in across + sides] + [box(r, 1.0, 1.0 + rail) for r in handrail]
    found = layout([*shell((0, 0, 4, 3), front=[Hole(1, 1.9)]), *balcony])
    assert [round(a) for a in areas(found)] == [12, 7]
    assert {c.closed_by for c in found.candidates} == {"lintel", "rail"}


@pytest.mark.parametrize(("roof_m", "rooms"), [(0.0, 1), (1.8, 2)])
def test_a_railed_terrace_beyond_the_slab_over_the_house_is_no_room(roof_m: float, rooms: int) -> None:
    rails = [(-0.2, -1.8, 4.2, -1.75), (-0.2, -1.75, -0.15, -0.2), (4.15, -1.75, 4.2, -0.2)]
    terrace = [box(r, 0, 1.0) for r in rails]
    house = [*shell((0, 0, 4, 3), front=[Hole(1, 1.9)]), *terrace]
    assert len(layout(house, cover=shapely.box(-0.2, -0.2 - roof_m, 4.2, 3.2)).rooms) == rooms


U_SHAPE = [*wall((-0.2, -0.2, 0, 4.2)), *wall((0, 4, 5, 4.2)), *wall((5, -0.2, 5.2, 4.2))]


def test_an_open_front_is_closed_at_the_edge_of_its_floor() -> None:
    found = layout(U_SHAPE, floor=shapely.box(0, -1.0, 5, 4))
    assert areas(found) == [25.0]
    assert {c.closed_by for c in found.candidates} == {"floor_edge"}


@pytest.mark.parametrize("juts_m", [0.0, 0.015, 0.03])
def test_a_slab_that_juts_out_from_under_its_walls_closes_an_open_corner(juts_m: float) -> None:
    walls = [*wall((-0.2, -0.2, 0, 4.2)), *wall((0, 4, 5, 4.2)), *wall((5, 1.0, 5.2, 4.2)), *wall((0, -0.2, 4, 0))]
    found = layout(walls, floor=shapely.box(-0.2, -0.2 - juts_m, 5.2 + juts_m, 4.2))
    assert sum(areas(found)) == pytest.approx(20.4, abs=0.2)
    assert {c.closed_by for c in found.candidates} == {"floor_edge"}


def test_an_open_front_without_a_floor_is_closed_between_its_walls() -> None:
    found = layout(U_SHAPE)
    assert sum(areas(found)) == pytest.approx(21.0, abs=0.5)
    assert {c.closed_by for c in found.candidates} == {"wall_ends"}


def test_walls_on_two_sides_are_a_room_along_the_edge_of_the_floor() -> None:
    floor, corner = shapely.box(0, 0, 5, 4), [*wall((-0.2, 0.0, 0.0, 4.2)), *wall((0.0, 4.0, 5.0, 4.2))]
    assert areas(layout(corner, floor=floor)) == [20.0]
    assert areas(layout([*corner, *wall((5.0, 0.0, 5.2, 4.2))], floor=floor)) == [20.0]
    with pytest.raises(Rejection, match="expected at least 2 m²") as caught:  # nothing says how far the room reaches
        layout(corner)
    assert caught.value.reason is Reason.NOT_ENCLOSED


def test_a_house_on_posts_is_closed_along_its_floor_or_its_roof() -> None:
    places = [(x, y) for x in (0.0, 3.9, 7.8) for y in (0.0, 4.8)]
    posts = [box((x, y, x + 0.2, y + 0.2), 0.0, 2.5) for x, y in places]
    roof, floor = box((0.0, 0.0, 8.0, 5.0), 2.5, 2.7), shapely.box(0, 0, 8, 5)
    for found in (layout([*posts, roof], floor=floor), layout([*posts, roof])):
        assert areas(found) == [pytest.approx(40.0 - 6 * 0.04, abs=0.1)]
    with pytest.raises(Rejection):  # a terrace with bollards
        layout(posts, floor=floor)
    with pytest.raises(Rejection):  # a sign on two legs
        layout([*posts[:2], roof], floor=floor)


def test_of_three_rooms_with_equal_open_fronts_none_is_left_out() -> None:
    """A doll's house without a floor; when two of its rooms are closed, more than half of it is."""
    house = [*wall((-0.2, -0.2, 0.0, 4.2)), *wall((0.0, 4.0, 12.0, 4.2)), *wall((12.0, -0.2, 12.2, 4.2))]
    house += [part for x in (3.9, 7.9) for part in wall((x, 0.0, x + 0.2, 4.0), Hole(1.5, 2.4))]
    assert len(layout(house).rooms) == 3


@pytest.mark.parametrize(("slit", "rooms"), [(0.1, 4), (0.5, 3)])
def test_a_slit_between_two_corners_parts_the_rooms(slit: float, rooms: int) -> None:
    """Two closed rooms in opposite corners of a house; between their own corners two more meet, or nearly so."""
    end = 3.1 + slit
    first = [*wall((0.0, 3.0, 4.1, 3.1)), *wall((4.0, 0.0, 4.1, 3.0))]
    second = [*wall((end + 1, end, end + 1.1, 6.5)), *wall((end + 1.1, end, 8.2, end + 0.1))]
    assert len(layout([*shell((0, 0, 8.2, 6.5)), *first, *second]).rooms) == rooms


def test_an_open_corner_is_closed_between_ends_of_walls_not_at_a_gate_that_is_dropped() -> None:
    """An L of two halves, open where they meet; a piece of wall between them makes a wide gap beside the corner."""
    outline = [(-0.2, -4.2, 0.0, 4.2), (0.0, 4.0, 8.2, 4.2), (8.0, 0.0, 8.2, 4.0), (6.6, -0.2, 8.2, 0.0)]
    outline += [(0.0, -4.2, 5.2, -4.0), (5.0, -4.0, 5.2, -1.5)]
    between = (3.4, -0.2, 4.2, 0.0)
    found = layout([part for rectangle in (*outline, between) for part in wall(rectangle)])
    assert sum(areas(found)) == pytest.approx(52.0, abs=2.5)


@pytest.mark.parametrize(("ways", "rooms"), [(3, 4), (2, 3)])
def test_a_hall_with_a_wide_entrance_is_a_room_where_three_ways_lead_into_it(ways: int, rooms: int) -> None:
    """Three rooms of 4 x 6 m in a row, and a hall of 4 m before them, whose front is open by 4.5 m in its middle."""
    house = [*wall((-0.2, 4.0, 12.2, 4.2), *[gap(1.5 + 4 * k, 2.6 + 4 * k) for k in range(ways)])]
    house += [*wall((-0.2, 10.2, 12.2, 10.4)), *wall((-0.2, -0.2, 12.2, 0.0), gap(4.0, 8.5))]
    house += [*wall((-0.2, 0.0, 0.0, 10.2)), *wall((12.0, 0.0, 12.2, 10.2))]
    house += [part for x in (3.9, 8.1) for part in wall((x, 4.2, x + 0.2, 10.2), Hole(6, 7))]
    found = layout(house)
    assert len(found.rooms) == rooms
    gates = [c for c in found.candidates if c.closed_by == "gate" and c.is_strip and OUTSIDE in c.sides]
    assert [opening.width for opening in gates] == pytest.approx([4.5] if rooms == 4 else [], abs=0.02)


def test_a_corridor_without_a_floor_is_a_room_where_gaps_lead_into_it() -> None:
    """Four rooms with floors along a corridor that has none, and no door anywhere."""
    gaps = [gap(x, x + 1.2) for x in (1.0, 4.0)]
    house = [*shell((0, 0, 6.2, 7.7)), *wall((0, 3.0, 6.2, 3.1), *gaps), *wall((0, 4.6, 6.2, 4.7), *gaps)]
    house += [*wall((3.0, 0, 3.1, 3.0)), *wall((3.0, 4.7, 3.1, 7.7))]
    floor = shapely.union_all([shapely.box(0, 0, 6.2, 3.0), shapely.box(0, 4.7, 6.2, 7.7)])
    assert [round(area) for area in areas(layout(house, floor=floor))] == [9, 9, 9, 9, 9]


def test_an_open_terrace_beside_a_closed_room_is_a_room_too() -> None:
    room = shell((0, 0, 5, 4), front=[Hole(1, 1.9)])
    sides = [*wall((-0.2, -3, 0, -0.2)), *wall((5, -3, 5.2, -0.2))]
    found = layout([*room, *sides], floor=shapely.union_all([shapely.box(0, 0, 5, 4), shapely.box(0, -3, 5, -0.2)]))
    assert [round(a) for a in areas(found)] == [20, 14]


@pytest.mark.parametrize(
    ("shape", "told"),
    [
        ("one wall", r"walls stand in one piece on 5\.0 x 0\.2 m, and close no place all round"),
        ("a box of a metre", r"the largest of 1 closed places has 1\.0 m²"),
    ],
)
def test_what_encloses_next_to_nothing_is_rejected(shape: str, told: str) -> None:
    parts = wall((0, 0, 5, 0.2)) if shape == "one wall" else shell((0, 0, 1, 1))
    with pytest.raises(Rejection, match=told) as caught:
        layout(parts)
    assert (caught.value.stage, caught.value.reason) == ("layout", Reason.NOT_ENCLOSED)
    assert "guess" not in caught.value.advice


def test_a_rejection_names_the_size_that_was_guessed() -> None:
    with pytest.raises(Rejection) as caught:
        layout(shell((0, 0, 1, 1)), guesses=("units",), provenance={"source": "mesh", "units": "mm", "up": "y"})
    assert "a unit of mm, y up is a guess (units): if it is wrong, say --units" in caught.value.advice


# H, L, U, N: strokes of 0.2 m that stand apart, with an O that encloses some
LETTERS = [
    *[box(r, 0, 2.5) for r in ((0, 0, 0.2, 4), (2, 0, 2.2, 4), (0.2, 1.9, 2, 2.1))],
    *[box(r, 0, 2.5) for r in ((4, 0, 4.2, 4), (4.2, 0, 6, 0.2))],
    *[box(r, 0, 2.5) for r in ((8, 0, 8.2, 4), (8.2, 0, 10, 0.2), (10, 0, 10.2, 4))],
    *shell((12.2, 0.2, 14.0, 3.8)),
]


@pytest.mark.parametrize("width", [1.2, 2.8])
def test_a_gap_to_the_outside_may_be_wider(width: float) -> None:
    walls = [box(r, 0, 2.5) for r in ((0, -0.2, 1, 0), (1 + width, -0.2, 6, 0))]
    walls += [box(r, 0, 2.5) for r in ((-0.2, -0.2, 0, 4), (6, -0.2, 6.2, 4), (-0.2, 4, 6.2, 4.2))]
    walls += shell((10, 0, 16, 4))
    found = layout(walls)
    assert len(found.rooms) == 2
    assert [candidate.closed_by for candidate in found.candidates] in (["gap"], ["gate"])


def test_walls_that_spell_characters_are_no_house() -> None:
    with pytest.raises(Rejection) as caught:
        layout(LETTERS)
    assert (caught.value.stage, caught.value.reason) == ("layout", Reason.CHARACTERS)


@pytest.mark.parametrize("aside", [0.05, 0.15, 0.25])
def test_a_gap_between_walls_that_stand_aside_of_each_other_is_closed(aside: float) -> None:
    lower, upper = (4.0, 0.0, 4.2, 1.4), (4.0 + aside, 2.6, 4.2 + aside, 4.0)
    found = layout([*shell((0, 0, 8, 4)), *wall(lower), *wall(upper)])
    assert len(found.rooms) == 2
    assert [candidate.closed_by for candidate in found.candidates] in (["gap"], ["gate"])


def test_a_single_room_that_walls_surround_nearly_all_round_has_a_front() -> None:
    """A room of 6 x 4 m with a front of 3 m; the jambs have frames, so that no wall ends at the front."""
    walls = [(-0.2, -0.2, 6.2, 0.0), (6.0, 0.0, 6.2, 4.0), (-0.2, 4.0, 6.2, 4.2)]
    jambs = [(-0.2, 0.0, 0.0, 0.5), (-0.2, 3.5, 0.0, 4.0)]
    frames = [(-0.3, 0.45, 0.1, 0.5), (-0.3, 3.5, 0.1, 3.55)]
    found = layout([part for rectangle in (*walls, *jambs, *frames) for part in wall(rectangle)])
    assert "wall_ends" in [candidate.closed_by for candidate in found.candidates]
    assert sum(areas(found)) == pytest.approx(24.5, abs=0.5)


@pytest.mark.parametrize("reach_m", [0.6, 1.4])
def test_under_the_eaves_is_no_room(reach_m: float) -> None:
    walls = shell((0, 0, 8, 4), front=[window(1, 2), window(4, 5.2)])
    x1, y1, x2, y2 = -reach_m, -reach_m, 8 + reach_m, 4 + reach_m
    eaves = [box(r, 2.1, 2.5) for r in ((x1, y1, x2, y1 + 0.05), (x1, y2 - 0.05, x2, y2))]
    eaves += [box(r, 2.1, 2.5) for r in ((x1, y1, x1 + 0.05, y2), (x2 - 0.05, y1, x2, y2))]
    found = layout([*walls, *eaves])
    assert areas(found) == [32.0]


@pytest.mark.parametrize(("deep_m", "rooms"), [(1.5, 1), (3.0, 2)])
def test_a_porch_under_a_long_lintel_is_no_room(deep_m: float, rooms: int) -> None:
    """Walls at both sides, a lintel over 5.6 m in front: open for 0.38 of the edge, or for 0.31."""
    front = -0.2 - deep_m
    house = shell((0, 0, 6, 4), front=[Hole(1, 1.9)])
    sides = [*wall((-0.2, front, 0.0, -0.2)), *wall((6.0, front, 6.2, -0.2))]
    found = layout([*house, *sides, *wall((-0.2, front - 0.2, 6.2, front), Hole(0.2, 5.8))])
    assert len(found.rooms) == rooms
    assert areas(found)[0] == 24.0


@pytest.mark.parametrize(("sill_m", "kinds"), [(0.2, ["lintel"]), (0.25, ["lintel"]), (0.35, []), (0.42, [])])
def test_what_has_a_sill_higher_than_any_threshold_is_a_window(sill_m: float, kinds: list[str]) -> None:
    found = layout(shell((0, 0, 6, 4), front=[Hole(1, 2.4, sill_m)]))
    assert [c.closed_by for c in found.candidates] == kinds


@pytest.mark.parametrize(("panes", "ways"), [(1, 1), (3, 0)])
def test_a_row_of_panes_from_the_floor_up_is_no_row_of_entrances(panes: int, ways: int) -> None:
    """Panes of 1.2 m in the middle of a wall of 0.2 m, under a lintel each; one alone is the leaf of a door."""
    starts = [1.0 + 1.3 * k for k in range(panes)]
    house = shell((0, 0, 6, 4), front=[Hole(start, start + 1.2) for start in starts])
    glass = [box((start + 0.01, -0.12, start + 1.19, -0.08), 0.02, 2.08) for start in starts]
    found = layout([*house, *glass])
    assert sum(OUTSIDE in c.sides and c.closed_by != "lintel" for c in found.candidates if c.is_strip) == ways
    assert len([c for c in found.candidates if c.is_strip]) == ways


@pytest.mark.parametrize(("crack_m", "rooms"), [(0.01, 2), (0.04, 2)])
def test_walls_that_nearly_meet_in_a_corner_close_it(crack_m: float, rooms: int) -> None:
    """A closed room of 8 x 4 m, and one of 6 x 4 m in whose corner neither wall points at the other."""
    apart = -6.0 - crack_m
    walls = [*shell((0, 0, 8, 4)), *wall((apart, 4, -0.2, 4.2)), *wall((-6, -0.2, -0.2, 0))]
    walls += wall((apart - 0.2, crack_m, apart, 4.2))
    assert len(layout(walls).rooms) == rooms


def test_a_porch_between_posts_is_no_room() -> None:
    """Three lintels of 1.8 m over 0.38 of the edge, none of them too wide for a door with two leaves."""
    house = shell((0, 0, 6, 4), front=[Hole(1, 1.9)])
    sides = [*wall((-0.2, -1.7, 0.0, -0.2)), *wall((6.0, -1.7, 6.2, -0.2))]
    front = wall((-0.2, -1.9, 6.2, -1.7), Hole(0.3, 2.1), Hole(2.2, 4.0), Hole(4.1, 5.9))
    assert areas(layout([*house, *sides, *front])) == [24.0]


def test_a_small_room_with_one_double_door_is_no_porch() -> None:
    """A vestibule of 1.2 m x 1.2 m, whose doorway of 1.8 m takes 0.35 of its edge and more."""
    house = shell((0, 0, 6, 4), front=[Hole(1, 1.9)])
    front = wall((0.0, -1.2, 2.3, -1.0), Hole(0.2, 2.1))
    sides = [*wall((0.0, -1.0, 0.2, -0.2)), *wall((2.1, -1.0, 2.3, -0.2))]
    assert len(areas(layout([*house, *sides, *front]))) == 2


def test_a_terrace_that_ends_at_the_edge_of_the_floor_is_no_room() -> None:
    house = shell((0, 0, 6, 4), front=[Hole(1, 1.9)])
    floor = shapely.box(0, -3.0, 6, 4)
    assert areas(layout([*house, *wall((-0.2, -3.0, 0.0, -0.2))], floor=floor)) == [24.0]


@pytest.mark.parametrize("deep_m", [1.6, 2.2, 3.2])
@pytest.mark.parametrize("marked", [True, False])
def test_a_room_that_lies_open_along_its_long_side_is_a_room_where_the_source_marks_each_door(
    deep_m: float, marked: bool
) -> None:
    """Open for 0.39, 0.37 or 0.33 of its edge; SUNCG draws the floors of rooms only, others those of terraces too."""
    house = shell((0, 0, 6, 4), front=[Hole(1, 1.9, low=0.04)])
    sides = [*wall((-0.2, -0.2 - deep_m, 0.0, -0.2)), *wall((6.0, -0.2 - deep_m, 6.2, -0.2))]
    floor = shapely.union_all([shapely.box(0, -0.2 - deep_m, 6, -0.2), shapely.box(0, 0, 6, 4)])
    found = layout([*house, *sides], floor=floor, sills=marked)
    assert len(found.rooms) == (2 if marked or deep_m > 3 else 1)


def test_rooms_at_the_edge_of_the_floor_are_rooms_where_the_house_is_cut_open() -> None:
    walls = [*wall((-0.2, 4, 9.2, 4.2)), *wall((-0.2, 0, 0, 4)), *wall((9, 0, 9.2, 4)), *wall((6, 0, 6.2, 4))]
    found = layout([*walls, *wall((6.2, 0, 9, 0.2))], floor=shapely.box(0, 0, 9, 4))
    assert len(found.rooms) == 2


def test_a_terrace_is_no_room_beside_a_hall_that_lies_open_for_a_small_share_of_its_edge() -> None:
    """The hall of 10 x 6 m ends at the edge of the floor for 3.5 m; the house is not cut open for that."""
    walls = [*wall((-0.2, 6, 10.2, 6.2)), *wall((-0.2, 0, 0, 6)), *wall((10, 0, 10.2, 1)), *wall((10, 4.5, 10.2, 6))]
    walls += [*wall((-0.2, -0.2, 10.2, 0), Hole(1, 1.9)), *wall((-0.2, -3.0, 0.0, -0.2))]
    floor = shapely.union_all([shapely.box(0, -3.0, 6, 0), shapely.box(0, 0, 10.05, 6)])
    assert areas(layout(walls, floor=floor)) == [60.0]


@pytest.mark.parametrize(("width", "rooms"), [(4.0, 3), (0.9, 2)])
def test_the_hall_to_which_two_rooms_lie_open_is_no_terrace(width: float, rooms: int) -> None:
    """Its own sides lie open at the edge of the floor. Behind doors, it may be a terrace."""
    outline = [(-0.2, 0.0, 0.0, 3.0), (8.2, 6.0, 16.4, 6.2), (16.2, 0.0, 16.4, 6.0), (8.2, -0.2, 16.4, 0.0)]
    outline += [(-0.2, -8.2, 0.0, -0.2), (0.0, -8.2, 8.2, -8.0), (8.0, -8.0, 8.2, -0.2)]
    house = [part for rectangle in outline for part in wall(rectangle)]
    house += [*wall((8.0, 0.0, 8.2, 6.2), Hole(1, 1 + width)), *wall((-0.2, -0.2, 8.2, 0.0), Hole(2, 2 + width))]
    floor = shapely.union_all([shapely.box(0, -8, 8, 6), shapely.box(8, 0, 16.2, 6)])
    assert len(layout(house, floor=floor).rooms) == rooms


def test_a_terrace_before_the_hall_to_which_two_rooms_lie_open_is_no_hall() -> None:
    """The terrace opens to the hall alone; the rooms open to the hall, whose own left side lies open."""
    outline = [(-0.2, 0.0, 0.0, 0.2), (8.2, 6.0, 16.4, 6.2), (16.2, 0.0, 16.4, 6.0), (8.2, -0.2, 16.4, 0.0)]
    outline += [(-0.2, -8.2, 0.0, -0.2), (0.0, -8.2, 8.2, -8.0), (8.0, -8.0, 8.2, -0.2), (8.0, 6.2, 8.2, 9.0)]
    house = [part for rectangle in outline for part in wall(rectangle)]
    house += [*wall((8.0, 0.0, 8.2, 6.2), Hole(1, 5)), *wall((-0.2, -0.2, 8.2, 0.0), Hole(2, 6))]
    house += wall((-0.2, 6.0, 8.0, 6.2), Hole(0.5, 2.9), Hole(4.8, 7.2))
    floor = shapely.union_all([shapely.box(0, -8, 8, 9), shapely.box(8, 0, 16.2, 6)])
    assert len(layout(house, floor=floor).rooms) == 3


def test_open_rooms_with_a_floor_are_no_characters() -> None:
    with pytest.raises(Rejection):
        layout(LETTERS)
    assert layout(LETTERS, floor=shapely.box(-0.2, -0.2, 14.4, 4.2)).rooms


def test_a_room_with_a_door_needs_no_floor_where_others_have_one() -> None:
    door = Opening.named(shapely.box(4.0, 0.5, 4.2, 2.0), has_door=True)
    found = layout(two_rooms(Hole(0.5, 2.0)), floor=shapely.box(0, 0, 4, 3), openings=(door,), named_openings=True)
    assert len(found.rooms) == 2


@pytest.mark.parametrize(
    ("doors", "joined", "rooms"),
    [(2, False, 3), (1, False, 3), (1, True, 2)],
    ids=["two doors", "only way", "one door"],
)
def test_a_corridor_needs_no_floor_where_doors_lead_into_it_or_nothing_else_joins_its_rooms(
    doors: int, joined: bool, rooms: int
) -> None:
    holes = [(0.3, 1.1), (1.6, 2.4)][:doors]
    named = [Opening.named(shapely.box(3.0, a, 3.1, b), has_door=True) for a, b in holes]
    house = three_rooms([Hole(a, b) for a, b in holes], [Hole(0.2, 2.8)])
    floor = shapely.union(shapely.box(0, 0, 3, 3), shapely.box(6.3, 0, 9.3, 3))
    if joined:  # a second room along the row, into which a door leads from both
        house = [part for part in house if not (part.bounds[0][1] < -0.1 and part.bounds[1][1] < 0.1)]
        house += [*wall((-0.2, -0.2, 9.5, 0.0), Hole(1.0, 1.8), Hole(7.0, 7.8)), *wall((-0.2, -2.2, 9.5, -2.0))]
        house += [*wall((-0.2, -2.0, 0.0, -0.2)), *wall((9.3, -2.0, 9.5, -0.2))]
        named += [Opening.named(shapely.box(a, -0.2, a + 0.8, 0.0), has_door=True) for a in (1.0, 7.0)]
        floor = shapely.union(floor, shapely.box(0, -2, 9.3, -0.2))
    found = layout(house, floor=floor, openings=tuple(named))
    assert len(found.rooms) == rooms + joined


@pytest.mark.parametrize(("width", "rooms"), [(1.0, 1), (3.0, 2)])
def test_a_balcony_to_which_no_door_is_seen_is_no_room(width: float, rooms: int) -> None:
    """A railing bounds 45% of its edge, or 30%."""
    house = [*shell((0, 0, 6, 4)), *wall((-0.2, -0.2 - width, 0.0, -0.2)), *wall((6.0, -0.2 - width, 6.2, -0.2))]
    railing = box((0, -0.25 - width, 6, -0.2 - width), 0.0, 1.0)
    floor = shapely.union(shapely.box(0, 0, 6, 4), shapely.box(0, -0.2 - width, 6, -0.2))
    assert len(layout([*house, railing], floor=floor).rooms) == rooms


def test_where_a_slab_goes_on_past_the_corner_of_an_l_is_no_room() -> None:
    outline = [(-0.2, -0.2, 8.2, 0.0), (-0.2, 0.0, 0.0, 6.2), (0.0, 6.0, 4.2, 6.2), (4.0, 3.0, 4.2, 6.0)]
    outline += [(4.2, 3.0, 8.2, 3.2), (8.0, 0.0, 8.2, 3.0)]
    found = layout([part for rectangle in outline for part in wall(rectangle)], floor=shapely.box(0, 0, 8, 6))
    assert areas(found) == [pytest.approx(36.0, abs=0.1)]


def test_a_person_may_say_that_they_are() -> None:
    assert layout(LETTERS, LayoutConfig(characters=False)).rooms


def test_a_row_of_closed_houses_is_no_word() -> None:
    row = [part for k in range(4) for part in shell((6.0 * k, 0, 6.0 * k + 5, 4))]
    assert len(layout(row).rooms) == 4


def test_closed_rooms_that_stand_far_apart_on_floors_of_their_own_are_no_word() -> None:
    """The floors are a small part of what all of the rooms span."""
    rooms = [(14.0 * x, 14.0 * y, 14.0 * x + 4, 14.0 * y + 4) for x, y in ((0, 0), (2, 1), (0, 2))]
    walls = [part for rectangle in rooms for part in shell(rectangle)]
    with pytest.raises(Rejection):
        layout(walls)
    assert len(layout(walls, floor=shapely.union_all([shapely.box(*each) for each in rooms])).rooms) == 3


def test_wings_of_many_rooms_are_no_word() -> None:
    wings = [part for x in (0.0, 14.0, 28.0) for part in shell((x, 0, x + 3, 12.6))]
    across = [part for x in (0.0, 14.0, 28.0) for y in (3.0, 6.2, 9.4) for part in wall((x, y, x + 3, y + 0.2))]
    assert len(layout([*wings, *across]).rooms) == 12


@pytest.mark.parametrize(("covered_m", "only_walls", "rooms"), [(6.1, False, 2), (9.3, False, 3), (6.1, True, 3)])
def test_what_has_no_floor_nothing_above_and_no_way_in_is_the_inside_of_a_wall(
    covered_m: float, only_walls: bool, rooms: int
) -> None:
    house = three_rooms([Hole(1.0, 1.9)])
    floor, cover = shapely.box(0, 0, 6.1, 3), shapely.box(0, 0, covered_m, 3)
    assert len(layout(house, floor=floor, cover=cover, only_walls=only_walls).rooms) == rooms


@pytest.mark.parametrize(("outward", "rooms"), [(True, 1), (False, 2)])
def test_a_box_of_sheets_that_is_seen_from_the_hall_around_it_is_no_room(outward: bool, rooms: int) -> None:
    """The walls of a hall of sheets that look inwards, and a plinth of 2 x 2 m in it, up to the ceiling."""
    hall, plinth = [(0, 0), (0, 8), (10, 8), (10, 0)], [(4, 3), (6, 3), (6, 5), (4, 5)]
    inward = [sheet(a, b, 0.0, 2.6) for a, b in zip(hall, [*hall[1:], hall[0]], strict=True)]
    corners = plinth if outward else plinth[::-1]
    around = [sheet(a, b, 0.0, 2.6) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]
    assert len(layout([*inward, *around]).rooms) == rooms


@pytest.mark.parametrize(("deep_m", "rooms"), [(1.6, 1), (0.7, 2)])
def test_what_a_block_fills_is_no_room_and_has_no_entrance(deep_m: float, rooms: int) -> None:
    """A corner of 1.5 m x 1.6 m under a lintel on both sides, and a block in it, or one that leaves half of it."""
    beam = [box((0.0, 1.6, 1.6, 1.7), 2.0, 2.6), box((1.5, 0.0, 1.6, 1.6), 2.0, 2.6)]
    found = layout([*shell((0, 0, 6, 4)), *beam, box((0.0, 0.0, 1.5, deep_m), 0.0, 1.7)])
    assert len(found.rooms) == rooms
    assert not any(OUTSIDE in c.sides for c in found.candidates if c.is_strip)


WELL = shapely.box(3.0, 1.0, 5.0, 4.0)
FLOOR = shapely.box(0, 0, 5, 4).difference(WELL)
GALLERY, AIR = shapely.box(0, 0, 2, 4), shapely.box(2, 0, 5, 4)
HALL = SourceRoom(("Hall",), ("Hall",), shapely.box(0, 0, 5, 4))


@pytest.mark.parametrize(
    ("values", "area"),
    [
        ({"below": WELL}, 14.0),
        ({"below": None}, 20.0),
        ({"below": WELL, "rooms": (HALL,), "only_walls": True}, 20.0),
        ({"below": WELL, "floor": shapely.box(0, 0, 1, 4)}, 20.0),
        ({"below": WELL, "stairs": shapely.box(3, 1, 5, 3.5)}, 14.0),
        ({"below": AIR, "floor": GALLERY}, 8.0),
        ({"below": AIR, "floor": GALLERY, "only_walls": True}, 20.0),
    ],
    ids=[
        "a stair's void",
        "a storey by itself",
        "a void in a room of the source",
        "most of the floor is not there",
        "a stair that fills it",
        "the air over a hall beside its gallery",
        "a slab of which a source that names walls draws a part",
    ],
)
def test_over_a_void_in_the_floor_is_no_free_space(values: dict[str, object], area: float) -> None:
    (room,) = layout(shell((0, 0, 5, 4)), **{"floor": FLOOR} | values).rooms
    assert room.area == pytest.approx(area, abs=0.2)


@pytest.mark.parametrize(("below", "rooms"), [(None, 2), (shapely.box(6, 0, 11, 4), 1)])
def test_the_upper_part_of_a_hall_is_no_room(below: shapely.Polygon | None, rooms: int) -> None:
    """Walls close a space without a door. Only where one looks down on a floor from it does it belong to the hall."""
    house = [*shell((0, 0, 2, 2)), *shell((6, 0, 11, 4))]
    assert len(layout(house, floor=shapely.box(-0.2, -0.2, 2.2, 2.2), below=below).rooms) == rooms


def test_a_storey_of_named_walls_without_a_slab_and_without_doors_keeps_its_rooms() -> None:
    """Its rooms lie over the floor of the lower storey: nobody drew the slab between."""
    below = shapely.box(-0.2, -0.2, 11.2, 4.2)
    house = [*shell((0, 0, 2, 2)), *shell((6, 0, 11, 4))]
    found = layout(house, only_walls=True, floor=shapely.box(-0.2, -0.2, 2.2, 2.2), below=below)
    assert len(found.rooms) == 2


@pytest.mark.parametrize(("name", "rooms"), [(None, 1), ("Loggia", 2)])
def test_what_the_source_says_is_outside_is_no_room_unless_it_is_named(name: str | None, rooms: int) -> None:
    there = shapely.box(4.2, 0, 7.2, 3)
    named = (SourceRoom((name,), (), there),) if name else ()
    found = layout(two_rooms(Hole(1, 1.9)), outdoors=there, rooms=named)
    assert len(found.rooms) == rooms
    assert [OUTSIDE in c.sides for c in found.candidates if c.is_strip] == [rooms == 1]


def test_a_door_that_opens_on_a_void_is_none_between_rooms() -> None:
    house = {"floor": shapely.box(0, 0, 4, 3), "below": shapely.box(4.2, 0, 7.2, 3)}
    assert len(layout(two_rooms(Hole(1, 1.9)), **house).rooms) == 1


@pytest.mark.parametrize(("stairs", "rooms"), [(shapely.box(4.4, 0, 7.2, 3), 2), (shapely.box(6.2, 0, 7.2, 3), 1)])
def test_a_room_without_a_landing_is_a_stairwell_if_stairs_fill_it(stairs: shapely.Polygon, rooms: int) -> None:
    house = {"floor": shapely.box(0, 0, 4, 3), "below": shapely.box(4.2, 0, 7.2, 3), "stairs": stairs}
    assert len(layout(two_rooms(Hole(1, 1.9)), **house).rooms) == rooms


def test_a_room_of_the_source_that_lies_open_is_closed_along_its_edge() -> None:
    """Under a roof without knee walls stand the gables only, and a partition with a door."""
    gables = [*wall((-0.2, 0, 0, 4)), *wall((8.0, 0, 8.2, 4)), *wall((4.0, 0, 4.2, 4), Hole(1.5, 2.4))]
    attic = tuple(SourceRoom((name,), (), shapely.box(x, 0.5, x + 3.8, 3.5)) for name, x in (("A", 0.1), ("B", 4.2)))
    found = layout(gables, rooms=attic)
    assert areas(found) == [11.4, 11.4]
    assert {c.closed_by for c in found.candidates} == {"room_edge", "lintel"}
    with pytest.raises(Rejection):
        layout(gables[:2])


def test_a_named_room_that_lies_open_says_nothing_of_the_rest_of_the_floor() -> None:
    """An outer wall is missing; one of the four rooms behind it has a name."""
    walls = [
        *wall((-0.2, 4, 12.2, 4.2)),
        *(each for x in (-0.2, 3.0, 6.0, 9.0, 12.0) for each in wall((x, 0, x + 0.2, 4))),
    ]
    named = SourceRoom(("Office",), (), shapely.box(3.2, 0, 6.0, 4))
    floor = shapely.box(-0.2, 0, 12.2, 4.2)
    assert len(layout(walls, floor=floor, rooms=(named,)).rooms) == 4


def test_a_small_room_of_the_source_is_closed_along_its_edge_with_those_beside_it() -> None:
    gables = [*wall((-0.2, 0, 0, 4)), *wall((9.0, 0, 9.2, 4))]
    rooms = {"A": (0.0, 3.9), "WC": (3.9, 5.1), "B": (5.1, 9.0)}
    drawn = [SourceRoom((name,), (), shapely.box(x1, 2.0, x2, 3.5)) for name, (x1, x2) in rooms.items()]
    assert areas(layout(gables, rooms=tuple(drawn))) == [13.5]
    with pytest.raises(Rejection):
        layout(gables, rooms=(drawn[1],))


def test_a_room_of_the_source_that_walls_enclose_keeps_their_edge() -> None:
    drawn = (SourceRoom(("A",), (), shapely.box(0.5, 0.5, 4.5, 3.5)),)
    found = layout(shell((0, 0, 5, 4)), rooms=drawn)
    assert areas(found) == [20.0]
    assert not found.candidates


@pytest.mark.parametrize(("post_m", "gaps", "rooms"), [(0.1, 3, 1), (0.1, 2, 2), (0.6, 3, 2)])
def test_gaps_between_a_row_of_posts_part_nothing(post_m: float, gaps: int, rooms: int) -> None:
    ways = [gap(0.3 + k * (0.5 + post_m), 0.8 + k * (0.5 + post_m)) for k in range(gaps)]
    assert len(layout(two_rooms(*ways)).rooms) == rooms


@pytest.mark.parametrize("has_door", [True, False])
@pytest.mark.parametrize("beside", [gap(1.4, 4.2), Hole(1.4, 4.2, 0.0, 2.42)])
def test_a_named_door_parts_two_rooms_though_a_wide_gap_or_a_header_is_beside_it(beside: Hole, has_door: bool) -> None:
    """R7: an opening of 2.8 m in the same wall, of full height or under a header of 8 cm, that the source omits."""
    between = wall((4.0, 0.0, 4.2, 4.4), Hole(0.2, 1.1), beside)
    opening = Opening.named(shapely.box(4.0, 0.2, 4.2, 1.1), has_door)
    found = layout([*shell((0.0, 0.0, 7.2, 4.4)), *between], openings=(opening,), named_openings=True)
    assert len(found.rooms) == (2 if has_door else 1)
