"""The picture of the evidence: each kind of thing in its own colour, where it stands, and the source's metres."""

from __future__ import annotations

import io

import numpy as np
import numpy.typing as npt
import pytest
import shapely
import trimesh
from PIL import Image, ImageColor

from houseexpo.drawing.styles import WALL
from houseexpo.plan import Frame
from pipeline.pictures import (
    CROSS,
    DOORWAY,
    EVIDENCE_FLOOR,
    EVIDENCE_LINTEL,
    EVIDENCE_RAIL,
    FURNITURE,
    LEAF,
    AreaCanvas,
    draw_evidence,
    ruler_ticks,
    turned_ticks,
)
from pipeline.png import PNG_SIDE_PX, draw_top_view
from pipeline.values import Evidence, Mesh, Opening

BOUNDS = (0.0, 0.0, 9.0, 9.0)
UPRIGHT = Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0)


def spot(x: float, y: float) -> shapely.Polygon:
    return shapely.box(x, y, x + 1, y + 1)


EVERYTHING = Evidence(
    walls=spot(1, 1),
    tall=spot(1, 1),
    lintels=spot(3, 1),
    rails=spot(5, 1),
    furniture=spot(7, 1),
    doorways=(Opening.named(spot(1, 3), has_door=True),),
    leaves=(spot(3, 3),),
    floor=spot(5, 3),
)
COLOURS = {
    (1.5, 1.5): WALL,
    (3.5, 1.5): EVIDENCE_LINTEL,
    (5.5, 1.5): EVIDENCE_RAIL,
    (7.5, 1.5): FURNITURE,
    (1.5, 3.5): DOORWAY,
    (3.5, 3.5): LEAF,
    (5.5, 3.5): EVIDENCE_FLOOR,
}


def at(picture: np.ndarray, x: float, y: float) -> str:
    scale = 900 / 10  # 9 m and half a metre of margin on each side
    return "#" + bytes(picture[round((9.5 - y) * scale), round((x + 0.5) * scale)].tolist()).hex()


def test_each_kind_has_its_colour_and_no_other_has_it() -> None:
    picture = draw_evidence(EVERYTHING, BOUNDS, UPRIGHT)
    assert {point: at(picture, *point) for point in COLOURS} == COLOURS
    assert len(set(COLOURS.values())) == len(COLOURS)
    assert at(picture, 7.5, 7.5) == "#ffffff"


@pytest.mark.parametrize(
    ("factor", "shift", "expected"),
    [
        (1.0, 0.0, [(0.0, "0"), (1.0, "1"), (2.0, "2"), (3.0, "3")]),
        (1.0, 100.25, [(-0.25, "100"), (0.75, "101"), (1.75, "102"), (2.75, "103")]),
        (-1.0, 0.0, [(3.0, "-3"), (2.0, "-2"), (1.0, "-1"), (0.0, "0")]),
    ],
)
def test_the_ruler_has_the_source_s_metres(factor: float, shift: float, expected: list[tuple[float, str]]) -> None:
    assert [tick for tick in ruler_ticks(-0.5, 3.5, factor, shift) if float(tick[1]).is_integer()] == expected


def test_the_ruler_is_drawn_on_the_lower_and_the_left_edge() -> None:
    canvas, plain = AreaCanvas(BOUNDS), AreaCanvas(BOUNDS)
    canvas.ruler(UPRIGHT)
    rows, cols = np.nonzero((np.asarray(canvas.image) != np.asarray(plain.image)).any(axis=-1))
    assert len(rows) > 100
    edge = 1800 * 0.95  # pixels before scaling down
    assert ((rows > edge) | (cols < 1800 - edge)).all()


def test_crosses_name_the_source_s_metres_in_a_turned_frame() -> None:
    turned = Frame(((0.6, -0.8, 20.0), (0.8, 0.6, -3.0)), "z", 0.0, 0)
    ticks = {words: place for place, words in turned_ticks(BOUNDS, turned)}
    assert len(ticks) > 10
    for words, (x, y) in ticks.items():
        assert list(map(float, words.split(", "))) == pytest.approx([0.6 * x - 0.8 * y + 20, 0.8 * x + 0.6 * y - 3])
        assert 0 < x < 9
        assert 0 < y < 9
    canvas = AreaCanvas(BOUNDS)
    canvas.ruler(turned)
    for place in ticks.values():
        assert canvas.image.getpixel(tuple(map(round, canvas._pixel(place)))) == ImageColor.getrgb(CROSS)


# What a source looks like from above.


def seen(mesh: Mesh, up: int = 2) -> npt.NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(draw_top_view(mesh, up))))


def block(*bounds: list[list[float]]) -> Mesh:
    found = trimesh.util.concatenate([trimesh.creation.box(bounds=b) for b in bounds])
    return Mesh(np.array(found.vertices), np.array(found.faces, np.int64))


STEPS = block([[0, 0, 0], [4, 4, 0.1]], [[4, 0, 0], [8, 4, 3]])  # low on the left, high on the right


def test_what_is_higher_is_darker_and_nothing_is_white() -> None:
    view = seen(STEPS)
    assert view.shape == (PNG_SIDE_PX // 2, PNG_SIDE_PX)
    assert view[50, 150] < view[50, 50] < 255
    apart = seen(block([[0, 0, 0], [1, 1, 1]], [[9, 9, 0], [10, 10, 1]]))
    assert apart[10, 10] == apart[190, 190] == 255
    assert apart[10, 190] < 255
    assert apart[190, 10] < 255


def test_y_points_up_and_a_y_up_mesh_is_seen_from_above_too() -> None:
    x, y, z = STEPS.vertices.T
    assert (seen(Mesh(np.column_stack([x, z, -y]), STEPS.faces), up=1) == seen(STEPS)).mean() > 0.97


def test_the_same_mesh_gives_the_same_bytes_and_one_without_area_none() -> None:
    assert draw_top_view(STEPS) == draw_top_view(STEPS)
    assert draw_top_view(Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))) == b""
    assert draw_top_view(Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64))) == b""
