"""Small pictures: whole tenths of a pixel, the plan's own shape in the middle of the square."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import shapely

from houseexpo.drawing.styles import dark_colours, style_named
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door
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


def test_windows_lie_in_the_wall_as_it_is_drawn() -> None:
    plan = two_rooms("a1", 4.0)  # 0.1 to 7.2 m, 0.1 to 3.1 m
    below = Door(0, "window", ((1, -0.1), (2, -0.1)), 1, [(1, -0.3), (1, 0.1), (2, 0.1), (2, -0.3)], (0, None))
    above = Door(1, "window", ((1, 3.25), (2, 3.25)), 1, [(1, 3.4), (2, 3.4), (2, 3.1), (1, 3.1)], (0, None))
    picture = draw_thumbnail(replace(plan, windows=(below, above)))
    assert draw_thumbnail(plan)[:-6] == picture[: len(draw_thumbnail(plan)) - 6]
    (found,) = re.findall(rb'<path d="([^"]+)" fill="[^"]+"/></svg>', picture)
    scale = 1880 / 7.1
    low, high = (np.array(ring.split(), dtype=int).reshape(-1, 2)[:, 1] for ring in found[1:-1].split(b"ZM"))
    for ring, face, way in ((low, 0.1, 1), (high, 3.1, -1)):
        edge = 1000 - (face - 1.6) * scale
        assert ((ring - edge) * way / (0.15 * scale)).min() == pytest.approx(1 / 3, abs=0.03)
        assert ((ring - edge) * way / (0.15 * scale)).max() == pytest.approx(2 / 3, abs=0.03)


def test_walls_are_dark_and_on_dark_pages_light() -> None:
    plan = two_rooms("a1")
    picture = draw_thumbnail(plan).decode()
    style = style_named("architect")
    dark = dark_colours(style, {room.label for room in plan.rooms})
    for kind, colour in re.findall(r' (fill|stroke)="(#\w+)"', picture):
        assert f'[{kind}="{colour}"]{{{kind}:{dark[colour]}}}' in picture
    assert f'stroke="{style.wall}"' in picture
    assert {style.room(room.label) for room in plan.rooms} <= set(re.findall(r'fill="(#\w+)"', picture))
