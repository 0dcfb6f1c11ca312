from __future__ import annotations

import gzip
import re
from dataclasses import replace
from itertools import islice
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import shapely

from houseexpo.drawing import contact_sheet, draw_plan, svg
from houseexpo.drawing.door_leaves import door_leaves
from houseexpo.drawing.room_names import SMALLEST_PX, load_font
from houseexpo.drawing.scene import lay_out_plan
from houseexpo.drawing.styles import DOOR_COLOURS, FURNITURE, FURNITURE_EDGE, WALL, style_named
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan import Door, PlanObject, Room
from houseexpo.plan.room_labels import label_colour
from tests.builders.shared import DATA, needs_shared


def rgb(text: str) -> list[int]:
    return list(bytes.fromhex(text[1:]))


def at(image: np.ndarray, plan, point: tuple[float, float], scale: float) -> list[int]:
    """The colour at a point in metres."""
    x1, _, _, y2 = lay_out_plan(plan, scale, 0).bounds
    return image[int((y2 - point[1]) * scale), int((point[0] - x1) * scale)].tolist()


def test_what_lies_where(two_rooms):
    image = draw_plan(two_rooms, 50, style="semantic")
    assert image.dtype == np.uint8
    expected = {
        (0.5, 0.5): label_colour("Living_Room"),
        (6.9, 2.8): label_colour("Unlabelled"),
        (4.15, 0.5): WALL,
        (1.2, 1.2): WALL,  # the pillar
        (4.15, 1.5): DOOR_COLOURS["door"],
        (0.05, 1.5): DOOR_COLOURS["entrance"],
    }
    assert {p: at(image, two_rooms, p, 50) for p in expected} == {p: rgb(c) for p, c in expected.items()}
    assert image[0, 0].tolist() == [255, 255, 255]


def test_furniture_is_drawn_lightly_with_an_edge(furnished):
    image = draw_plan(furnished, 50, style="semantic")
    assert at(image, furnished, (1.2, 1.2), 50) == rgb(FURNITURE)
    assert at(image, furnished, (1.01, 1.2), 50) == rgb(FURNITURE_EDGE)
    assert at(image, furnished, (4.15, 0.5), 50) == rgb(WALL)
    assert "furniture</text>" in svg(furnished, style="semantic")


def test_what_is_unsure_is_dashed_and_hatched(two_rooms):
    room, other = two_rooms.rooms
    door = two_rooms.doors[0]
    sure = replace(two_rooms, rooms=(replace(room, confidence=0.9), other), doors=(replace(door, confidence=0.5),))
    bare = replace(two_rooms, doors=(door,))
    assert (draw_plan(sure, 50) == draw_plan(bare, 50)).all()
    assert "unsure</text>" not in svg(sure)
    dashed = replace(bare, doors=(replace(door, confidence=0.4),))
    assert "unsure</text>" in svg(dashed)
    along = [
        at(draw_plan(dashed, 50, style="semantic"), two_rooms, (4.15, y), 50) == rgb(DOOR_COLOURS["door"])
        for y in np.arange(1, 2, 0.02)
    ]
    assert int(np.abs(np.diff(np.array(along, int))).sum()) >= 5  # so many changes between dash and gap
    hatched = replace(bare, rooms=(replace(room, confidence=0.4), other))
    changed = (draw_plan(hatched, 50)[:200] != draw_plan(bare, 50)[:200]).any(axis=-1).mean()
    assert 0.02 < changed < 0.3


def test_the_same_plan_gives_the_same_picture(two_rooms):
    assert (draw_plan(two_rooms) == draw_plan(two_rooms)).all()
    assert svg(two_rooms) == svg(two_rooms)
    assert two_rooms._repr_svg_() == svg(two_rooms, size=480)


def test_a_room_without_a_label_has_the_name_that_its_source_gives_it(two_rooms):
    first, *others = two_rooms.rooms
    for source, name in (
        ((), ""),
        (("stairwell",), "Stairwell"),
        (("flur_oben", "diele"), "Flur oben / diele"),
        (("17", "Bad", "2"), "Bad"),
        (("17", "20"), "17"),
    ):
        room = replace(first, label="Unlabelled", source_labels=source)
        assert room.name == name
        drawn = svg(replace(two_rooms, rooms=(room, *others)))
        assert all(word in drawn for word in name.split()), "Unlabelled" not in drawn
    assert replace(first, label="Living_Room", source_labels=("salon",)).name == "Living Room"


def test_svg_escapes_what_the_plan_brings(two_rooms):
    room = replace(two_rooms.rooms[0], label="Unlabelled", source_labels=("a<b>&\x01c",))
    ET.fromstring(svg(replace(two_rooms, id="a<b>&c", rooms=(room, *two_rooms.rooms[1:]))))  # noqa: S314 - our own text


def test_a_picture_without_a_size_is_refused(two_rooms):
    for asked in ({"size": 0}, {"pixels_per_metre": 0.0}, {"pixels_per_metre": float("nan")}):
        with pytest.raises(ConfigError, match="picture: expected a size of more than 0 pixels"):
            draw_plan(two_rooms, **asked)


def test_contact_sheet():
    images = [np.full((20 + 10 * i, 30, 3), 60 * i, dtype=np.uint8) for i in range(3)]
    sheet = contact_sheet(images, 2, ["one", "two", "three"])
    for i in range(3):
        assert ((sheet == 60 * i).all(axis=-1)).sum() >= images[i].shape[0] * 30
    assert contact_sheet(images, 3).shape[0] < sheet.shape[0]
    with pytest.raises(ConfigError, match="found 0 images"):
        contact_sheet([], 2)


def test_an_architects_walls_are_filled_and_doors_have_leaves(two_rooms):
    style = style_named("architect")
    image = draw_plan(two_rooms, 50)
    assert at(image, two_rooms, (4.15, 0.5), 50) == rgb(style.wall)
    assert at(image, two_rooms, (4.15, 1.5), 50) == rgb(style.floor)
    assert at(image, two_rooms, (0.5, 0.5), 50) == rgb(style.room("Living_Room"))
    (leaf,) = door_leaves(two_rooms)[two_rooms.doors[0].id]
    assert at(image, two_rooms, tuple((leaf.hinge + 3 * leaf.end) / 4), 50) == rgb(style.ink)


def test_a_balcony_is_outside_the_walls():
    corners = [(0.1, 0.1), (0.1, 4.1), (2.0, 4.1), (2.0, 4.5), (0.1, 4.5), (0.1, 6.0), (4.1, 6.0), (4.1, 4.5)]
    corners += [(3.0, 4.5), (3.0, 4.1), (4.1, 4.1), (4.1, 0.1)]
    ring = np.array([(2.0, 4.1), (2.0, 4.5), (3.0, 4.5), (3.0, 4.1)])
    door = Door(0, "door", ((2.0, 4.3), (3.0, 4.3)), 1.0, ring, (0, 1))
    inside, outside = shapely.box(0.1, 0.1, 4.1, 4.1), shapely.box(0.1, 4.5, 4.1, 6.0)
    rooms = [
        Room(k, label, shapely.get_coordinates(shape)[:-1])
        for k, (label, shape) in enumerate({"Living_Room": inside, "Balcony": outside}.items())
    ]
    plan = replace(FloorPlan("0" * 32, corners, 2, {}), rooms=tuple(rooms), doors=(door,))
    image, look = draw_plan(plan, 50), style_named("architect")
    wall, grass, paper = (rgb(colour) for colour in (look.wall, look.room("Balcony"), look.paper))
    expected = {(1.0, 4.18): wall, (1.0, 4.4): grass, (1.0, 6.12): paper, (4.2, 2.0): wall, (4.2, 5.0): paper}
    assert {point: at(image, plan, point, 50) for point in expected} == expected


def test_an_unknown_style_is_refused(two_rooms):
    with pytest.raises(ConfigError, match="style: expected one of architect, technical, semantic, found 'pretty'"):
        draw_plan(two_rooms, style="pretty")


def test_what_a_dark_page_shows_is_light_on_dark(two_rooms):
    text = svg(two_rooms)
    style = style_named("architect")
    rules = dict(re.findall(r"\[fill=\"(#\w+)\"\]\{fill:(#\w+)\}", text))
    fills = set(re.findall(r"<\w+[^>]* fill=\"(#\w+)\"", text))
    assert fills <= rules.keys()
    assert sum(rgb(rules[style.floor])) < sum(rgb(rules[style.wall]))
    assert sum(rgb(rules[style.paper])) < 150 < sum(rgb(rules[style.ink]))
    assert "prefers-color-scheme" not in svg(two_rooms, style="technical")


def test_a_leaf_opens_into_the_room_against_a_wall():
    """A hall of 1.5 m below a bedroom; the door is 0.2 m from the bedroom's left wall."""
    hall = Room(0, "Hallway", np.array([(0, 0), (0, 1.5), (4, 1.5), (4, 0.0)]))
    bedroom = Room(1, "Bedroom", np.array([(0, 1.6), (0, 5), (4, 5), (4, 1.6)]))
    door = Door(
        0, "door", ((0.2, 1.55), (1.1, 1.55)), 0.9, np.array([(0.2, 1.5), (0.2, 1.6), (1.1, 1.6), (1.1, 1.5)]), (0, 1)
    )
    verts = [
        (0, 0),
        (0, 1.5),
        (0.2, 1.5),
        (0.2, 1.6),
        (0, 1.6),
        (0, 5),
        (4, 5),
        (4, 1.6),
        (1.1, 1.6),
        (1.1, 1.5),
        (4, 1.5),
        (4, 0),
    ]
    plan = FloorPlan("hall", verts, 2, {}, rooms=(hall, bedroom), doors=(door,))
    (leaf,) = door_leaves(plan)[0]
    assert np.allclose([leaf.hinge, leaf.end, leaf.arc[-1]], [(0.2, 1.6), (0.2, 2.5), (1.1, 1.6)])
    # a chest where the leaf would stand: the other hinge
    chest = PlanObject(0, "chest", 1, np.array([(0, 1.9), (0, 2.4), (0.45, 2.4), (0.45, 1.9)]), 0.8)
    beside = replace(
        bedroom, ring=np.array([(0, 1.6), (0, 1.9), (0.45, 1.9), (0.45, 2.4), (0, 2.4), (0, 5), (4, 5), (4, 1.6)])
    )
    (leaf,) = door_leaves(replace(plan, rooms=(hall, beside), objects=(chest,)))[0]
    assert np.allclose([leaf.hinge, leaf.end], [(1.1, 1.6), (1.1, 2.5)])
    # a wide door has two leaves, a passage none
    wide = replace(door, segment=((0.2, 1.55), (2.0, 1.55)), width=1.8, ring=door.ring * (2, 1) - (0.2, 0))
    assert [leaf.hinge.tolist() for leaf in door_leaves(replace(plan, doors=(wide,)))[0]] == [[0.2, 1.6], [2.0, 1.6]]
    assert door_leaves(replace(plan, doors=(replace(door, kind="opening"),))) == {}


def test_leaves_hang_so_that_later_doors_have_room_too():
    """Alone, the front door opens to the right, where the leaf of a shallow cupboard has its only place."""
    entry = Room(0, "Entryway", np.array([(-1, 0), (-1, 1.3), (2.2, 1.3), (2.2, 0.0)]))
    cupboard = Room(1, "Storage", np.array([(2.3, 0), (2.3, 1.3), (2.7, 1.3), (2.7, 0.0)]))
    gap = np.array([(0.9, 0), (0.9, -0.3), (1.8, -0.3), (1.8, 0)])
    front = Door(0, "entrance", ((0.9, -0.15), (1.8, -0.15)), 0.9, gap, (0, None))
    gap = np.array([(2.2, 0.45), (2.2, 1.15), (2.3, 1.15), (2.3, 0.45)])
    inner = Door(1, "door", ((2.25, 0.45), (2.25, 1.15)), 0.7, gap, (0, 1))
    ring = [(-1, 0), (-1, 1.3), (2.7, 1.3), (2.7, 0)]
    plan = FloorPlan("entry", ring, 2, {}, rooms=(entry, cupboard), doors=(front, inner))
    (alone,) = door_leaves(replace(plan, doors=(front,)))[0]
    assert alone.hinge.tolist() == [1.8, 0.0]
    for doors in ((front, inner), (inner, front)):
        (one,), (other,) = door_leaves(replace(plan, doors=doors)).values()
        assert one.swing.intersection(other.swing).area < 0.01
        assert {tuple(one.hinge.tolist()), tuple(other.hinge.tolist())} == {(0.9, 0.0), (2.2, 1.15)}


def check_names(plan: FloorPlan, size: int) -> int:
    """Assert that all names lie in a room with its furniture, and apart from each other; return their number."""
    scene = lay_out_plan(plan, None, size)
    boxes = []
    for words in scene.words:
        across, up = words.box_m(scene.pixels_per_metre)
        boxes.append(shapely.box(words.x - across / 2, words.y - up / 2, words.x + across / 2, words.y + up / 2))
        measured = max(load_font(words.size).getlength(line.replace("²", "2")) for line in words.lines)
        assert (up if words.turned else across) * scene.pixels_per_metre >= measured
        assert words.size >= SMALLEST_PX
    floors = [
        shapely.union_all([room.polygon, *(thing.polygon for thing in plan.objects if thing.room == room.id)])
        for room in plan.rooms
    ]
    for box in boxes:
        assert any(floor.buffer(1e-6).covers(box) for floor in floors), plan.id
    for i, box in enumerate(boxes):
        assert all(box.intersection(other).area < 1e-9 for other in boxes[:i]), plan.id
    return len(boxes)


def test_names_stand_in_their_rooms(two_rooms, furnished, published_lines):
    plans = [two_rooms, furnished, *(decode(line).divided for line in published_lines[::10])]
    for size in (60, 200, 400, 1000):
        assert sum(check_names(plan, size) for plan in plans) > 0 or size == 60
    assert check_names(two_rooms, 400) == 2


@pytest.mark.slow
@needs_shared
def test_names_stand_in_their_rooms_in_300_published_plans():
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz", "rt") as file:
        lines = list(islice(file, 0, 33_600, 112))
    plans = [decode(line).divided for line in lines]
    assert len(plans) == 300
    rooms = sum(len(plan.rooms) for plan in plans)
    named = {size: sum(check_names(plan, size) for plan in plans) / rooms for size in (200, 400, 1000)}
    assert named[200] > 0.5
    assert named[400] > 0.8
    assert named[1000] > 0.9
