"""Read indoor maps in IndoorGML: cells as polygons or solids; doors as cells, boundaries or transitions."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest
import shapely

from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from tests.builders.batch import plans_of

CORE, NAVI = "http://www.opengis.net/indoorgml/1.0/core", "http://www.opengis.net/indoorgml/1.0/navigation"
GML, XLINK = "http://www.opengis.net/gml/3.2", "http://www.w3.org/1999/xlink"


def ring(corners, per_position=False):
    if per_position:
        inner = "".join(f"<gml:pos>{' '.join(map(str, corner))}</gml:pos>" for corner in corners)
    else:
        inner = f"<gml:posList>{' '.join(str(value) for corner in corners for value in corner)}</gml:posList>"
    return f"<gml:Polygon><gml:exterior><gml:LinearRing>{inner}</gml:LinearRing></gml:exterior></gml:Polygon>"


def flat(x1, y1, x2, y2, z=None):
    corners = [(x1, y1), (x2, y1), (x2, y2), (x1, y2), (x1, y1)]
    corners = corners if z is None else [(*corner, z) for corner in corners]
    return f"<core:Geometry2D>{ring(corners, per_position=z is not None)}</core:Geometry2D>"


def solid(x1, y1, x2, y2, low, high):
    """Return a box of six faces; the floor is neither the first nor the last."""
    sides = [(x1, y1), (x2, y1), (x2, y2), (x1, y2), (x1, y1)]
    faces = [[(*a, low), (*b, low), (*b, high), (*a, high), (*a, low)] for a, b in itertools.pairwise(sides)]
    faces[2:2] = [[(*corner, z) for corner in sides] for z in (high, low)]
    members = "".join(f"<gml:surfaceMember>{ring(face)}</gml:surfaceMember>" for face in faces)
    return (
        f"<core:Geometry3D><gml:Solid><gml:exterior><gml:Shell>{members}</gml:Shell></gml:exterior></gml:Solid>"
        "</core:Geometry3D>"
    )


def cell(name, geometry, kind="core:CellSpace"):
    return (
        f"<core:cellSpaceMember><{kind} gml:id='{name}'><gml:name>{name}</gml:name>"
        f"<core:cellSpaceGeometry>{geometry}</core:cellSpaceGeometry></{kind}></core:cellSpaceMember>"
    )


def transition(*points):
    text = "".join(f"<gml:pos>{x} {y} 0</gml:pos>" for x, y in points)
    return (
        "<core:transitionMember><core:Transition gml:id='T'><core:geometry><gml:LineString>"
        f"{text}</gml:LineString></core:geometry></core:Transition></core:transitionMember>"
    )


def boundary(*points):
    text = " ".join(f"{x} {y}" for x, y in points)
    return (
        "<core:cellSpaceBoundaryMember><navi:ConnectionBoundary gml:id='B'><core:cellSpaceBoundaryGeometry>"
        f"<core:geometry2D><gml:LineString><gml:posList srsDimension='2'>{text}</gml:posList></gml:LineString>"
        "</core:geometry2D></core:cellSpaceBoundaryGeometry></navi:ConnectionBoundary></core:cellSpaceBoundaryMember>"
    )


def write(file: Path, *parts: str) -> Path:
    names = f'xmlns:core="{CORE}" xmlns:navi="{NAVI}" xmlns:gml="{GML}" xmlns:xlink="{XLINK}"'
    body = f"<core:primalSpaceFeatures>{''.join(parts)}</core:primalSpaceFeatures>"
    file.write_text(f"<?xml version='1.0'?><core:IndoorFeatures {names}>{body}</core:IndoorFeatures>")
    return file


def levels(file):
    return [level for item in find(str(file)) for level in reader(item.reader).read(item)]


def plan_of(file):
    (plan,) = plans_of(file)
    return plan


ROOMS = (cell("Kitchen", flat(0, 0, 4, 5)), cell("Bedroom", flat(4, 0, 8, 5)))


@pytest.mark.parametrize(
    "door",
    [
        cell("D1", flat(3.95, 2, 4.05, 2.9), "navi:ConnectionSpace"),
        cell("Door 1", flat(3.95, 2, 4.05, 2.9)),
        boundary((4, 2), (4, 2.9)),
        transition((2, 2.45), (6, 2.45)),
    ],
    ids=["connection space", "called a door", "boundary", "transition"],
)
def test_rooms_that_touch_have_a_wall_with_the_door_that_is_said(tmp_path, door):
    plan = plan_of(write(tmp_path / "flat.gml", *ROOMS, door))
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]
    assert plan.area == pytest.approx(40.0, rel=0.03)
    (found,) = plan.doors
    x, y = found.polygon.centroid.coords[0]
    origin_x, origin_y = shapely.union_all([room.polygon for room in plan.rooms]).bounds[:2]
    assert (x - origin_x, y - origin_y) == (pytest.approx(4.0, abs=0.1), pytest.approx(2.45, abs=0.1))
    assert found.width == pytest.approx(0.9, abs=0.05)


def test_a_guessed_place_of_a_door_is_said(tmp_path):
    (level,) = levels(write(tmp_path / "flat.gml", *ROOMS, transition((2, 2), (6, 2))))
    assert level.guesses == ("doors",)
    (level,) = levels(write(tmp_path / "other.gml", *ROOMS, boundary((4, 2), (4, 2.9)), transition((2, 2), (6, 2))))
    assert level.guesses == ()


def test_solids_stand_on_their_floors_and_make_storeys(tmp_path):
    parts = [
        cell(f"{name} {z}", solid(x, 0, x + 4, 5, z, z + 2.8))
        for z in (0, 3)
        for x, name in ((0, "Hall"), (4, "Office"))
    ]
    found = levels(write(tmp_path / "tower.gml", *parts, transition((2, 2), (6, 2))))
    assert [level.frame.floor for level in found] == [0.0, 3.0]
    assert [sorted(room.labels for room in level.rooms) for level in found] == [[("Hall",), ("Office",)]] * 2
    assert all(level.floor.area == pytest.approx(40.0, rel=0.03) for level in found)


def test_positions_of_three_numbers_are_read_as_those_of_two(tmp_path):
    (level,) = levels(write(tmp_path / "flat.gml", cell("Kitchen", flat(0, 0, 4, 5, z=1.2))))
    assert level.frame.floor == 1.2
    assert level.rooms[0].polygon.area == pytest.approx(20.0)


def test_degrees_become_metres(tmp_path):
    corners = [(37.5 + y / 111_195, 127.0 + x / 88_216) for x, y in ((0, 0), (4, 0), (4, 5), (0, 5), (0, 0))]
    geometry = f"<core:Geometry2D srsName='EPSG:4326'>{ring(corners)}</core:Geometry2D>"
    (level,) = levels(write(tmp_path / "flat.gml", cell("Kitchen", geometry)))
    assert level.rooms[0].polygon.area == pytest.approx(20.0, rel=0.02)


@pytest.mark.parametrize(
    ("parts", "reason", "said"),
    [
        ((), Reason.NO_LEVEL, "expected cells with a floor, found none"),
        ((cell("Kitchen", ""),), Reason.NO_LEVEL, "expected cells with a floor"),
        (
            (cell("Kitchen", "<core:Geometry2D>" + ring([("a", 1)] * 4) + "</core:Geometry2D>"),),
            Reason.UNREADABLE,
            "expected coordinates, found",
        ),
        ((cell("Kitchen", flat(0, 0, "nan", 5)),), Reason.NOT_FINITE, "a coordinate is not finite"),
    ],
)
def test_bad_files_say_what_is_wrong(tmp_path, parts, reason, said):
    with pytest.raises(Rejection, match=said) as error:
        levels(write(tmp_path / "bad.gml", *parts))
    assert error.value.reason is reason


def test_other_gml_is_not_taken(tmp_path):
    file = tmp_path / "city.gml"
    file.write_text("<?xml version='1.0'?><CityModel xmlns='http://www.opengis.net/citygml/2.0'/>")
    assert not any(item.reader == "vector_plans" for item in _inputs(file))


def _inputs(file):
    try:
        return list(find(str(file)))
    except Exception:  # noqa: BLE001 - refused, which is as good
        return []
