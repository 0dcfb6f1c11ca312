"""Plans have the windows that their sources name, where they are and with the heights that the sources know."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from houseexpo.dataset.validation import OURS
from tests.builders.batch import plans_of
from tests.builders.formats import ifc, procthor, roomplan, sweethome


def tiny_ifc(path: Path) -> Path:
    ifc.tiny_house().write(path)
    return path


CUBICASA = """<svg xmlns="http://www.w3.org/2000/svg" width="800" height="500"><g class="Floorplan Floor-1">
<g class="Wall External"><polygon points="0,0 820,0 820,20 0,20"/></g>
<g class="Wall External"><polygon points="0,420 820,420 820,440 0,440"/>
<g class="Door Swing Beside"><polygon points="300,420 390,420 390,440 300,440"/></g></g>
<g class="Wall External"><polygon points="0,0 20,0 20,440 0,440"/></g>
<g class="Wall External"><polygon points="800,0 820,0 820,440 800,440"/>
<g class="Window Regular"><polygon points="800,100 820,100 820,250 800,250"/>
<g class="Panel"><polygon points="0,0 9,0 9,9"/></g></g></g>
<g class="Space Kitchen"><polygon points="20,20 800,20 800,420 20,420"/></g></g></svg>"""


@pytest.mark.parametrize(
    ("name", "write", "width", "heights"),
    [
        ("home.sh3d", lambda path: sweethome.write(path, sweethome.home()), 1.0, (0.9, 2.1)),
        ("house.json", lambda path: procthor.write(path, procthor.house()), 1.0, (0.9, 2.1)),
        ("house.ifc", tiny_ifc, 2.0, (0.9, 2.1)),
    ],
)
def test_the_window_of_a_house_is_in_its_plan(
    tmp_path: Path, name: str, write: Callable[[Path], Path], width: float, heights: tuple[float, float]
) -> None:
    plan, *others = plans_of(write(tmp_path / name))
    (window,) = plan.windows
    assert window.width == pytest.approx(width, abs=0.011)
    assert (window.sill, window.head) == pytest.approx(heights)
    assert window.rooms[1] is None
    assert list(OURS["windows"](plan)) == []
    assert all(other.windows == () for other in others)  # an upper storey has its own


def test_a_captured_room_has_its_windows(tmp_path: Path) -> None:
    (plan,) = plans_of(roomplan.write(tmp_path / "room.json", roomplan.home()))
    assert [(w.width, w.sill, w.head) for w in plan.windows] == [pytest.approx((1.0, 0.9, 2.0), abs=0.011)] * 2
    assert {w.rooms[0] for w in plan.windows} == {0, 1}


def test_a_drawing_has_windows_without_heights(tmp_path: Path) -> None:
    def draw(space: Any) -> None:
        for corners in ((0, 0, 6, 0), (6, 0, 6, 4), (6, 4, 0, 4), (0, 4, 0, 0)):
            space.add_line(corners[:2], corners[2:], dxfattribs={"layer": "WALL"})
        for corners in ((-0.2, -0.2, 6.2, -0.2), (6.2, -0.2, 6.2, 4.2), (6.2, 4.2, -0.2, 4.2), (-0.2, 4.2, -0.2, -0.2)):
            space.add_line(corners[:2], corners[2:], dxfattribs={"layer": "WALL"})
        for y in (-0.2, -0.1, 0.0):  # three lines through the wall
            space.add_line((1, y), (2.5, y), dxfattribs={"layer": "WINDOW"})
        space.add_lwpolyline([(3, 4), (4, 4), (4, 4.2), (3, 4.2)], close=True, dxfattribs={"layer": "WINDOW"})

    ezdxf = pytest.importorskip("ezdxf")
    document = ezdxf.new("R2010", units=6)
    draw(document.modelspace())
    document.saveas(tmp_path / "plan.dxf")
    (plan,) = plans_of(tmp_path / "plan.dxf")
    assert sorted((w.width, w.sill, w.head) for w in plan.windows) == [(1.0, None, None), (1.5, None, None)]
    assert all(w.polygon.area == pytest.approx(w.width * 0.2, abs=0.02) for w in plan.windows)


def test_a_labelled_picture_has_windows(tmp_path: Path) -> None:
    file = tmp_path / "model.svg"
    file.write_text(CUBICASA)
    (plan,) = plans_of(file)
    (window,) = plan.windows
    assert (window.width / plan.bbox[3], window.sill) == (pytest.approx(150 / 400, abs=0.03), None)
