"""The picture of the evidence: each kind of thing in its own colour, where it stands, and the source's metres."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from houseexpo.drawing.styles import WALL
from houseexpo.plan import Frame
from pipeline.pictures import (
    DOORWAY,
    EVIDENCE_FLOOR,
    EVIDENCE_LINTEL,
    EVIDENCE_RAIL,
    FURNITURE,
    LEAF,
    Canvas,
    draw_evidence,
    ruler_ticks,
)
from pipeline.values import Evidence, Opening

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
    canvas, plain = Canvas(BOUNDS), Canvas(BOUNDS)
    canvas.ruler(UPRIGHT)
    rows, cols = np.nonzero((np.asarray(canvas.image) != np.asarray(plain.image)).any(axis=-1))
    assert len(rows) > 100
    edge = 1800 * 0.95  # pixels before scaling down
    assert ((rows > edge) | (cols < 1800 - edge)).all()


def test_a_turned_frame_has_no_ruler() -> None:
    turned = Frame(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0)), "z", 0.0, 0)
    canvas, plain = Canvas(BOUNDS), Canvas(BOUNDS)
    canvas.ruler(turned)
    assert canvas.image.tobytes() == plain.image.tobytes()
