import math
import re
import struct

import numpy as np
import pytest
import shapely

from pipeline.rejection import Reason, Rejection
from pipeline.sources import sweethome
from tests.builders.damage import outcome
from tests.builders.formats.java_home import java_home
from tests.builders.formats.sweethome import BED, DOOR, WALLS, home, room, wall, write
from tests.builders.houses import kinds, levels_of, plan_of


def one(tmp_path, xml):
    (level,) = levels_of(write(tmp_path / "home.sh3d", xml))
    return level


def standing(level, height=1.0):
    """What stands at a height, as triangles of the faces above it seen from above."""
    triangles = level.walls.vertices[level.walls.faces]
    flat = np.ptp(triangles[:, :, 2], axis=1) < 1e-6
    above = flat & (triangles[:, 0, 2] > height)
    return shapely.union_all(shapely.polygons(triangles[above][:, :, :2]), grid_size=1e-4)


def test_rooms_doors_and_frame_are_the_files_own(tmp_path):
    level = one(tmp_path, home())
    assert {room.words[0]: room.polygon.bounds for room in level.rooms} == {
        "Camera": (0.0, -3.0, 4.0, 0.0),  # y is turned up, and the frame turns it down again
        "Kitchen": (4.2, -3.0, 7.2, 0.0),
    }
    assert level.rooms[1].labels == ("Kitchen",)
    assert level.frame.matrix == ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0))
    between, front = level.openings  # the window is none
    assert between.polygon.bounds == pytest.approx((4.0, -1.95, 4.2, -1.05))  # through the whole wall
    assert front.polygon.bounds == pytest.approx((0.5, -3.2, 1.5, -3.0))
    assert (between.has_door, level.ceiling_m) == (True, 2.5)


def test_the_plan_has_both_rooms_the_door_and_the_entrance(tmp_path):
    plan = plan_of(one(tmp_path, home()))
    assert sorted(room.area for room in plan.rooms) == pytest.approx([9.0, 12.0], rel=0.01)
    assert kinds(plan) == ["door", "entrance"]


def test_a_frame_without_a_leaf_is_an_opening_and_a_part_of_a_piece_is_the_hole(tmp_path):
    level = one(
        tmp_path,
        home(door=DOOR.format(" wallLeft='0.25' wallWidth='0.5' catalogId='doorFrame'").replace("<sash/>", "")),
    )
    assert not level.openings[0].has_door
    assert level.openings[0].polygon.bounds == pytest.approx((4.0, -1.725, 4.2, -1.275))


GLASS = "<doorOrWindow {} x='200' y='-10' elevation='{}' width='100' depth='20' height='220'/>"


@pytest.mark.parametrize(
    ("kind", "elevation", "passages"),
    [
        ("name='Window'", 30, 2),
        ("name='Ventana'", 30, 2),
        ("catalogId='eTeks#window85x163'", 12, 2),
        ("catalogId='eTeks#fixedWindow85x123'", 0, 2),
        ("catalogId='eTeks#window85x163'", 0, 3),
        ("catalogId='eTeks#sliderWindow126x200'", 11, 3),
        ("name='Fenêtre coulissante'", 11, 3),
        ("catalogId='eTeks#frenchWindow85x200' name='French window'", 30, 3),
        ("name='Porte-fenêtre'", 30, 3),
        ("name='garden'", 30, 3),
    ],
)
def test_a_window_above_the_floor_is_no_way_however_low(tmp_path, kind, elevation, passages):
    level = one(tmp_path, home(GLASS.format(kind, elevation)))
    assert len(level.openings) == passages


BELOW = [(-10, -10, 310, -10), (310, -10, 310, -310), (310, -310, -10, -310), (-10, -310, -10, -10)]
"""Walls of a lower level beyond the wall of the upper one in which its glass stands."""


@pytest.mark.parametrize(
    ("elevation", "before", "passages"),
    [
        (270, "", 2),
        (0, "", 3),
        (270, room("Balcony", 100, -170, 300, -20), 3),
        (270, BED.replace("y='100'", "y='-120'").replace("x='100'", "x='200'"), 3),  # boards of a balcony
        (270, "".join(wall(f"b{k}", *ends, extra="level='below'") for k, ends in enumerate(BELOW)), 3),
    ],
    ids=["air", "at the ground", "balcony", "boards", "roof of a lower level"],
)
def test_a_french_window_of_an_upper_level_is_a_way_where_one_can_step_out(tmp_path, elevation, before, passages):
    glass = GLASS.format("catalogId='eTeks#frenchWindow85x200' name='French window'", 0)
    tiers = f"<level id='here' elevation='{elevation}'/><level id='below' elevation='-270'/>"
    text = home(glass, before)
    for tag in ("wall", "room", "doorOrWindow", "pieceOfFurniture"):
        text = re.sub(f"<{tag} (?![^>]*level=)", f"<{tag} level='here' ", text)
    level = levels_of(write(tmp_path / "h.sh3d", text.replace("</home>", f"{tiers}</home>")))[-1]
    assert len(level.openings) == passages


PIECE = "<pieceOfFurniture name='{}' x='410' y='{}' angle='1.5707964' width='90' depth='{}' height='{}'/>"


@pytest.mark.parametrize("name", ["Puerta", "Door 2", "Дверь"])
def test_furniture_that_is_called_a_door_and_stands_in_a_wall_is_one(tmp_path, name):
    level = one(tmp_path, home(PIECE.format(name, 150, 12, 205), door=""))
    assert [(each.polygon.bounds, each.has_door) for each in level.openings if each.polygon.centroid.x > 4] == [
        (pytest.approx((4.0, -1.95, 4.2, -1.05)), True)
    ]
    assert not level.furniture
    assert kinds(plan_of(level)) == ["door", "entrance"]


@pytest.mark.parametrize(
    "piece",
    [
        PIECE.format("Door mat", 150, 12, 205),
        PIECE.format("Puerta", 150, 12, 30),
        PIECE.format("Puerta", 150, 120, 205),
        PIECE.format("Puerta", 150, 12, 205).replace("x='410'", "x='600'"),
    ],
)
def test_what_is_no_door_by_its_name_its_size_or_its_place_stays_furniture(tmp_path, piece):
    level = one(tmp_path, home(piece, door=""))
    assert len(level.furniture) == 1
    assert len(level.openings) == 1


def test_an_open_leaf_belongs_to_no_hole(tmp_path):
    door = "<doorOrWindow name='d' x='370' y='150' angle='1.5707964' width='90' depth='100' height='208' "
    frame = "wallThickness='0.1' wallDistance='0.05'><sash/></doorOrWindow>"
    level = one(tmp_path, home(door=door + frame))
    assert level.openings[0].polygon.bounds == pytest.approx((4.0, -1.95, 4.2, -1.05))


def test_corners_are_filled_and_walls_that_are_not_joined_stay_apart(tmp_path):
    level = one(tmp_path, home())
    assert standing(level).bounds == pytest.approx((-0.2, -3.2, 7.4, 0.2))
    assert standing(level).contains(shapely.Point(-0.15, 0.15))


def test_bent_and_sloping_walls(tmp_path):
    bent = wall("b", 1000, 0, 1200, 0, f"arcExtent='{math.pi}'")
    sloping = wall("c", 1000, 500, 1200, 500, "heightAtEnd='50'")
    level = one(tmp_path, home(bent, sloping))
    area = standing(level, 0.5)
    assert area.contains(shapely.Point(11.0, 1.0))  # half a circle, over the line as drawn
    assert not area.intersects(shapely.Point(11.0, -1.0))
    assert standing(level, 2.0).intersects(shapely.Point(10.2, -5.0))
    assert not standing(level, 2.0).intersects(shapely.Point(11.8, -5.0))


def test_a_terrace_without_walls_is_no_room(tmp_path):
    level = one(tmp_path, home(room("Terrace", 0, 320, 400, 600)))
    assert [each.words for each in level.rooms] == [("Camera",), ("Kitchen",)]


def test_a_slit_between_a_room_and_its_wall_is_wall_an_undrawn_room_is_free(tmp_path):
    smaller = home().replace("<point x='400'", "<point x='370'")
    assert standing(one(tmp_path, smaller)).contains(shapely.Point(3.85, -0.5))
    undrawn = home().replace("name='Camera'", "name='Camera' level='none'")
    assert not standing(one(tmp_path, undrawn)).intersects(shapely.Point(2.0, -1.5))


def test_a_wall_ends_at_a_rooms_edge_unless_rooms_are_drawn_over_the_walls(tmp_path):
    pier = wall("p", 200, 0, 200, 50)
    assert not standing(one(tmp_path, home(pier))).intersects(shapely.Point(2.0, -0.3))
    over = home(pier).replace(
        "<point x='0' y='0'/><point x='400' y='0'/>", "<point x='-20' y='-20'/><point x='410' y='-20'/>"
    )
    over = over.replace(
        "<point x='400' y='300'/><point x='0' y='300'/>", "<point x='410' y='320'/><point x='-20' y='320'/>"
    )
    over = over.replace(
        "<point x='420' y='0'/><point x='720' y='0'/>", "<point x='410' y='-20'/><point x='740' y='-20'/>"
    )
    over = over.replace(
        "<point x='720' y='300'/><point x='420' y='300'/>", "<point x='740' y='320'/><point x='410' y='320'/>"
    )
    assert standing(one(tmp_path, over)).intersects(shapely.Point(2.0, -0.3))


@pytest.mark.parametrize("doors", [1, 0])
def test_rooms_without_any_wall_have_walls_along_their_edges_where_doors_stand_in_them(tmp_path, doors):
    rooms = room("Camera", 0, 0, 400, 300) + room("Kitchen", 400, 0, 720, 300)
    door = DOOR.format("").replace("x='410'", "x='402'") * doors
    path = write(tmp_path / "home.sh3d", f"<home version='6000' wallHeight='250'>{rooms}{door}</home>")
    if not doors:
        with pytest.raises(Rejection) as failed:
            levels_of(path)
        assert failed.value.reason == Reason.EMPTY
        return
    (level,) = levels_of(path)
    plan = plan_of(level)
    assert [each.label for each in plan.rooms] == ["Unlabelled", "Kitchen"]
    assert [each.area for each in plan.rooms] == pytest.approx([3.925 * 2.925, 3.125 * 2.925], abs=0.1)
    assert (kinds(plan), level.guesses) == (["door"], ("walls",))


def test_levels_and_furniture(tmp_path):
    levels_ = "<level id='a' name='Cellar' elevation='-270' height='250'/><level id='b' name='Ground' elevation='0'/>"
    on_a = home().split("<wall ", 1)
    text = on_a[0] + levels_ + "<wall " + on_a[1]
    text = text.replace("<wall ", "<wall level='a' ").replace("<room ", "<room level='a' ")
    text = text.replace("<doorOrWindow ", "<doorOrWindow level='a' ")
    upper = "".join(wall(f"u{k}", *ends).replace("<wall", "<wall level='b'") for k, ends in enumerate(
        [(-10, -10, 300, -10), (300, -10, 300, 300), (300, 300, -10, 300), (-10, 300, -10, -10)]))  # fmt: skip
    seen = BED.replace("name", "level='b' name")
    group = f"<furnitureGroup>{seen}</furnitureGroup>"
    hidden = BED.replace("name", "level='b' visible='false' name")
    below, above = levels_of(write(tmp_path / "h.sh3d", text.replace("</home>", upper + group + hidden + "</home>")))
    assert [each.frame.floor for each in (below, above)] == pytest.approx([-2.7, 0.0])
    assert (below.id[-3:], above.id[-3:]) == ("_L0", "_L1")
    (bed,) = above.furniture
    assert shapely.MultiPoint(bed.mesh.vertices[:, :2]).bounds == pytest.approx((0.55, -2.0, 1.45, 0.0), abs=1e-6)
    assert below.furniture == ()


def test_a_level_that_is_not_shown_is_one_all_the_same(tmp_path):
    level = "<level id='a' name='Ground' elevation='0' visible='false'/>"
    text = home().replace("<wall ", "<wall level='a' ").replace("<room ", "<room level='a' ")
    found = one(
        tmp_path, text.replace("</home>", f"{level}</home>").replace("<doorOrWindow ", "<doorOrWindow level='a' ")
    )
    assert len(found.rooms) == 2
    assert found.provenance["hidden"] == "yes"


@pytest.mark.parametrize(
    ("more", "note"),
    [
        ("<pieceOfFurniture name='sofa' x='nan' y='1' width='2' depth='2' height='2'/>", "x of pieceOfFurniture"),
        ("<light name='lamp' x='1e9' y='1' width='2' depth='2' height='2'/>", "x of light"),
        ("<room name='x'><point x='inf' y='0'/></room>", "x of point"),
    ],
)
def test_a_fault_costs_the_piece_that_it_is_in(tmp_path, more, note):
    found = one(tmp_path, home(more))
    assert len(found.rooms) == 2
    assert note in found.provenance["left_out"]


def test_a_home_is_known_by_its_content_packed_or_not(tmp_path):
    assert len(levels_of(write(tmp_path / "home.bin2", home()))) == 1
    (tmp_path / "Home.xml").write_text(home())
    assert len(levels_of(tmp_path / "Home.xml")) == 1


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<home/>", Reason.EMPTY),
        ("<house/>", Reason.UNREADABLE),
        (home().replace("'730'", "'nan'"), Reason.NOT_FINITE),
        (home().replace("'730'", "'1e9'"), Reason.BAD_UNITS),
        ("<!DOCTYPE home [<!ENTITY a 'b'>]>" + home().partition("?>")[2], Reason.UNREADABLE),
        ("", Reason.EMPTY),
    ],
)
def test_bad_homes(tmp_path, text, reason):
    found = outcome(write(tmp_path / "home.sh3d", text))
    assert isinstance(found, Rejection)
    assert found.reason is reason


def test_an_older_home_gives_the_same_plan(tmp_path):
    new = one(tmp_path, home(BED))
    (old,) = levels_of(write(tmp_path / "old.sh3d", java_home(home(BED)), name="Home"))
    assert np.allclose(old.walls.vertices, new.walls.vertices, atol=1e-6)
    assert [(room.words, room.polygon.bounds) for room in old.rooms] == [
        (room.words, pytest.approx(room.polygon.bounds, abs=1e-6)) for room in new.rooms
    ]
    assert [each.has_door for each in old.openings] == [each.has_door for each in new.openings]
    assert kinds(plan_of(old)) == kinds(plan_of(new))


def test_an_older_home_that_is_damaged_asks_to_be_saved_anew(tmp_path):
    found = outcome(write(tmp_path / "home.sh3d", b"\xac\xed\x00\x05sr", name="Home"))
    assert isinstance(found, Rejection)
    assert "5.3" in found.advice


@pytest.mark.slow
def test_hostile_zips(tmp_path):
    bomb = write(tmp_path / "bomb.sh3d", b"<home>" + b" " * (sweethome.LARGEST_BYTES + 10))
    assert outcome(bomb).reason is Reason.TOO_LARGE
    outside = write(tmp_path / "out.sh3d", home(), name="../Home.xml")
    assert isinstance(outcome(outside), Rejection)
    assert not (tmp_path.parent / "Home.xml").exists()
    data = bytearray(write(tmp_path / "home.sh3d", home()).read_bytes())
    place = data.rindex(b"PK\x01\x02")
    data[place + 42 : place + 46] = struct.pack("<I", 12345678)  # where the member is said to begin
    (tmp_path / "wrong.sh3d").write_bytes(data)
    assert outcome(tmp_path / "wrong.sh3d").reason is Reason.UNREADABLE


@pytest.mark.parametrize(("ends", "widths"), [((100, 220), [1.2]), ((0, 120), [1.2]), ((140, 160), []), ((0, 300), [])])
def test_between_two_rooms_a_way_is_left_where_a_wall_ends(tmp_path, ends, widths):
    """Without a door; a crack is none, and where no wall stands at all, the slit between the rooms is the wall."""
    text = home(door="")
    low, high = ends
    pieces = [wall(f"m{k}", 410, a, 410, b) for k, (a, b) in enumerate(((-10, low), (high, 310))) if b - a > 20]
    text = text.replace(wall("m", *WALLS["m"]), "".join(pieces))
    level = one(tmp_path, text)
    ways = [each.polygon.bounds for each in level.openings if not each.has_door]
    assert [round(high - low, 2) for _, low, _, high in ways] == widths
    assert standing(level).intersects(shapely.Point(4.1, -sum(ends) / 200)) == (not widths)
    plan = plan_of(level)
    assert sorted(door.kind for door in plan.doors) == (["entrance", "opening"] if widths else ["cut", "entrance"])
