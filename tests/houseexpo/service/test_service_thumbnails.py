"""Small pictures: whole tenths of a pixel, the plan's own shape in the middle of the square."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import shapely

from houseexpo.drawing.styles import dark_colours, style_named
from houseexpo.floorplan import FloorPlan
from houseexpo.service.thumbnails import draw_thumbnail
from tests.builders.services import two_rooms


def outline(picture: bytes) -> np.ndarray:
    """Return the points (n, 2) of a picture's first path."""
    path = re.search(rb'<path d="M([-\d ]+)Z', picture)
    assert path is not None
    return np.array(path[1].split(), dtype=int).reshape(-1, 2)


def test_a_plan_fills_the_square_and_y_points_up() -> None:
    plan = two_rooms("a1", 4.0)  # 7.1 x 3.0 m in 200 px, 6 px of them margin
    found = outline(draw_thumbnail(plan))
    scale = 1880 / 7.1
    wanted = np.array(plan.verts) * (scale, -scale)
    assert np.abs((found - found.mean(axis=0)) - (wanted - wanted.mean(axis=0))).max() <= 1.0
    assert (found.min(axis=0) + found.max(axis=0)).tolist() == [2000, 2000]


def test_label_boxes_are_rectangles_cut_by_the_outline() -> None:
    plan = replace(two_rooms("a1"), rooms=(), doors=(), room_category={"Kitchen": ((0.1, 0.1, 7.2, 3.1),)})
    assert b'<g clip-path="url(#a)"><path d="M60 1397H1940V603H60Z"' in draw_thumbnail(plan)


def test_an_outline_of_thousands_of_points_is_drawn_with_those_that_show() -> None:
    angle = np.linspace(0, -2 * np.pi, 12_000, endpoint=False)
    ring = np.round(100.1 + 100 * np.stack([np.cos(angle), np.sin(angle)], axis=1), 2)
    found = outline(draw_thumbnail(FloorPlan("round", ring, 1, {})))
    assert 30 < len(found) < 200
    assert abs(shapely.Polygon(found).area / (np.pi * 940**2) - 1) < 0.01


def test_walls_are_dark_and_on_dark_pages_light() -> None:
    plan = two_rooms("a1")
    picture = draw_thumbnail(plan).decode()
    style = style_named("architect")
    dark = dark_colours(style, {room.label for room in plan.rooms})
    for kind, colour in re.findall(r' (fill|stroke)="(#\w+)"', picture):
        assert f'[{kind}="{colour}"]{{{kind}:{dark[colour]}}}' in picture
    assert f'stroke="{style.wall}"' in picture
    assert {style.room(room.label) for room in plan.rooms} <= set(re.findall(r'fill="(#\w+)"', picture))
