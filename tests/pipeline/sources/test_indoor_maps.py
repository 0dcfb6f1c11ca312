"""Read indoor maps in IMDF: units, openings and levels in files of their own, as a folder or as a zip."""

import json
import zipfile

import numpy as np
import pytest

from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, reader
from pipeline.sources.vector_plans.imdf import can_read
from tests.builders.batch import plans_of

LOWER, UPPER = "9f-upper-by-name", "1a-lower-by-name"
"""Ids of levels, whose order is not that of the storeys."""


def degrees(x, y):
    return [127.1 + np.degrees(x / (6_371_008.8 * np.cos(np.radians(37.5)))), 37.5 + np.degrees(y / 6_371_008.8)]


def box(x1, y1, x2, y2):
    return {
        "type": "Polygon",
        "coordinates": [[degrees(*c) for c in ((x1, y1), (x2, y1), (x2, y2), (x1, y2), (x1, y1))]],
    }


def feature(kind, geometry, ident="f", **about):
    return {"type": "Feature", "id": ident, "feature_type": kind, "geometry": geometry, "properties": about}


def unit(category, corners, level=LOWER, name=None):
    return feature("unit", box(*corners), category=category, level_id=level, name=name, restriction=None)


def archive():
    """Two storeys of 8 m by 4 m: the lower has two rooms, a wall of glass between them, a column, and a hall's rest."""
    units = [
        unit("structure", (-0.2, -0.2, 8.2, 0.0)),
        unit("glass", (4.0, 0.0, 4.1, 4.0)),
        unit("column", (1.0, 1.0, 1.5, 1.5)),
        unit("nonpublic", (8.4, 0.0, 12.0, 4.0)),
        unit("restroom.male", (0.0, 0.0, 4.0, 4.0)),
        unit("walkway", (4.1, 0.0, 8.2, 4.0), name={"ko": "복도"}),
        unit("room", (0.0, 0.0, 8.2, 4.0), UPPER, {"en": "Kitchen"}),
    ]
    opening = {"type": "LineString", "coordinates": [degrees(4.05, 2.0), degrees(4.05, 2.9)]}
    way_in = {"type": "LineString", "coordinates": [degrees(8.25, 1.0), degrees(8.25, 2.0)]}
    return {
        "unit": units,
        "opening": [
            feature("opening", opening, category="pedestrian", level_id=LOWER, door={"type": "movablepartition"}),
            feature("opening", way_in, category="pedestrian.principal", level_id=LOWER, door=None),
        ],
        "level": [
            feature("level", box(0, 0, 8, 4), LOWER, ordinal=0, name={"en": "Ground"}),
            feature("level", box(0, 0, 8, 4), UPPER, ordinal=1),
        ],
        "venue": [feature("venue", box(0, 0, 8, 4), category="university")],
        "footprint": [feature("footprint", box(-1, -1, 9, 5), category="ground")],
    }


def written(folder, files=None):
    folder.mkdir(exist_ok=True)
    for name, features in (files or archive()).items():
        document = {"type": "FeatureCollection", "name": name, "features": features}
        (folder / f"{name}.geojson").write_text(json.dumps(document, ensure_ascii=False))
    return folder


def check(plans):
    lower, upper = plans
    assert sorted(room.label for room in lower.rooms) == ["Hallway", "Toilet"]
    assert [room.label for room in upper.rooms] == ["Kitchen"]
    assert {word for room in lower.rooms for word in room.source_labels} == {"복도", "restroom.male"}
    assert sorted(door.kind for door in lower.doors) == ["door", "entrance"]
    assert lower.area == pytest.approx(4.0 * 4.0 + 4.1 * 4.0 - 0.25 + 0.1 * 0.9, abs=0.1)
    assert upper.area == pytest.approx(8.2 * 4.0, abs=0.1)
    assert [plan.frame.level for plan in plans] == [0, 1]


def test_a_folder_is_one_building(tmp_path):
    check(plans_of(written(tmp_path / "mall")))


def test_so_is_its_file_of_units(tmp_path):
    check(plans_of(written(tmp_path / "mall") / "unit.geojson"))


def test_so_is_a_zip_of_it(tmp_path):
    folder = written(tmp_path / "mall")
    with zipfile.ZipFile(tmp_path / "mall.zip", "w") as packed:
        for file in sorted(folder.iterdir()):
            packed.write(file, f"mall/{file.name}")
        packed.writestr("__MACOSX/mall/._unit.geojson", b"junk")
    check(plans_of(tmp_path / "mall.zip"))


def test_levels_without_their_file_are_sorted_by_id(tmp_path):
    files = archive()
    del files["level"]
    first, second = plans_of(written(tmp_path / "mall", files))
    assert [room.label for room in first.rooms] == ["Kitchen"]
    assert sorted(room.label for room in second.rooms) == ["Hallway", "Toilet"]


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda files: files | {"unit": []}, Reason.NO_LEVEL),
        (lambda files: files | {"unit": [unit("structure", (0, 0, 4, 4))]}, Reason.NO_LEVEL),
        (
            lambda files: files | {"unit": [unit("room", (0, 0, 4, 4)), 7, {"feature_type": "unit"}], "opening": []},
            None,
        ),
    ],
)
def test_damaged_archives(tmp_path, damage, reason):
    files = damage(archive())
    folder = written(tmp_path / "mall", {**files, "unit": [feature("unit", None), *files["unit"]]})
    if reason is None:
        (plan,) = plans_of(folder)
        assert "unit.geojson: feature 0" in plan.provenance["left_out"]
        return
    (item,) = find(str(folder))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    assert caught.value.reason is reason


def test_a_zip_that_is_none_or_damaged(tmp_path):
    (tmp_path / "a.zip").write_bytes(b"PK\x03\x04 and no more")
    assert not can_read(tmp_path / "a.zip", b"PK\x03\x04")
    with zipfile.ZipFile(tmp_path / "b.zip", "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("unit.geojson", json.dumps({"features": archive()["unit"]}))
    data = bytearray((tmp_path / "b.zip").read_bytes())
    data[60:70] = bytes(10)
    (tmp_path / "b.zip").write_bytes(bytes(data))
    (item,) = find(str(tmp_path / "b.zip"))
    with pytest.raises(Rejection) as caught:
        list(reader(item.reader).read(item))
    assert caught.value.reason is Reason.UNREADABLE


@pytest.mark.parametrize("walled", [True, False])
def test_units_that_touch_are_parted_where_the_map_has_openings(tmp_path, walled):
    """Two classrooms beside a walkway in two parts, and a lobby without openings of its own."""
    units = [
        unit("classroom", (0.0, 2.0, 4.0, 6.0)),
        unit("classroom", (4.0, 2.0, 8.0, 6.0)),
        unit("walkway", (0.0, 0.0, 4.0, 2.0)),
        unit("walkway", (4.0, 0.0, 8.0, 2.0)),
        unit("lobby", (8.0, 0.0, 11.0, 2.0)),
    ]
    ways = [((1.0, 2.0), (2.0, 2.0)), ((5.0, 2.0), (6.0, 2.0))] if walled else []
    openings = [
        feature("opening", {"type": "LineString", "coordinates": [degrees(*a), degrees(*b)]}, level_id=LOWER, door={})
        for a, b in ways
    ]
    (plan,) = plans_of(written(tmp_path / "map", {"unit": units, "opening": openings}))
    assert len(plan.rooms) == 5
    assert [door.kind for door in plan.doors] == ["door"] * len(ways)
    assert (plan.area < 53.5) == walled
