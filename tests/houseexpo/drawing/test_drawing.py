from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from houseexpo.drawing import contact_sheet, draw_plan, svg
from houseexpo.drawing.scene import DOOR_COLOURS, FURNITURE, FURNITURE_EDGE, WALL, lay_out_plan
from houseexpo.errors import ConfigError
from houseexpo.floorplan import decode
from houseexpo.plan.room_labels import label_colour


def rgb(text: str) -> list[int]:
    return list(bytes.fromhex(text[1:]))


def at(image: np.ndarray, plan, point: tuple[float, float], scale: float) -> list[int]:
    """The colour at a point in metres."""
    x1, _, _, y2 = lay_out_plan(plan, scale, 0).bounds
    return image[int((y2 - point[1]) * scale), int((point[0] - x1) * scale)].tolist()


def test_what_lies_where(two_rooms):
    image = draw_plan(two_rooms, 50)
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
    image = draw_plan(furnished, 50)
    assert at(image, furnished, (1.2, 1.2), 50) == rgb(FURNITURE)
    assert at(image, furnished, (1.01, 1.2), 50) == rgb(FURNITURE_EDGE)
    assert at(image, furnished, (4.15, 0.5), 50) == rgb(WALL)
    assert "furniture</text>" in svg(furnished)


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
        at(draw_plan(dashed, 50), two_rooms, (4.15, y), 50) == rgb(DOOR_COLOURS["door"]) for y in np.arange(1, 2, 0.02)
    ]
    assert int(np.abs(np.diff(np.array(along, int))).sum()) >= 5  # so many changes between dash and gap
    hatched = replace(bare, rooms=(replace(room, confidence=0.4), other))
    changed = (draw_plan(hatched, 50)[:200] != draw_plan(bare, 50)[:200]).any(axis=-1).mean()
    assert 0.02 < changed < 0.3


def test_the_size_asked_for_is_kept_to(two_rooms, published_lines):
    assert 450 <= max(draw_plan(two_rooms, size=480).shape) <= 560
    assert 450 <= max(draw_plan(decode(published_lines[3]), size=480).shape) <= 560


def test_a_published_plan_shows_its_label_boxes(published_lines):
    plan = decode(published_lines[1])
    image = draw_plan(plan, size=300)
    shown = [label for label in plan.room_category if (image == rgb(label_colour(label))).all(axis=-1).sum() > 100]
    assert shown == ["Toilet", "Living_Room", "Office"]


def test_the_same_plan_gives_the_same_picture(two_rooms):
    assert (draw_plan(two_rooms) == draw_plan(two_rooms)).all()
    assert svg(two_rooms) == svg(two_rooms)
    assert two_rooms._repr_svg_() == svg(two_rooms, size=480)


def test_svg_holds_the_same(two_rooms):
    root = ET.fromstring(svg(two_rooms))  # noqa: S314 - our own text
    space = "{http://www.w3.org/2000/svg}"
    fills = {path.get("fill") for path in root.iter(f"{space}path")}
    assert {label_colour("Living_Room"), WALL, DOOR_COLOURS["door"], DOOR_COLOURS["entrance"]} <= fills
    texts = [text.text for text in root.iter(f"{space}text")]
    assert "Living Room" in texts
    assert "11.8 m²" in texts
    assert texts[-2:] == ["door", "entrance"]
    rows, cols, _ = draw_plan(two_rooms).shape
    assert root.get("viewBox") == f"0 0 {cols} {rows}"


def test_svg_escapes_what_the_plan_brings(two_rooms):
    from dataclasses import replace

    ET.fromstring(svg(replace(two_rooms, id="a<b>&c")))  # noqa: S314 - our own text


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
