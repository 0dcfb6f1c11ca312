"""From a correction to the plan of an export: where a person says that there is no way, none comes back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from houseexpo.corrections import Override
from houseexpo.corrections.apply import correct_plan
from houseexpo.exports import geojson
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from tests.builders.batch import labels, likeness, plans_of, through
from tests.builders.commands import call
from tests.builders.services import two_rooms

FORMS = ("dxf", "geojson", "svg")


@pytest.fixture
def denied() -> FloorPlan:
    """Two rooms, whose only door a person has denied."""
    plan = two_rooms("house")
    found = correct_plan(plan, Override(no_door=[4.15, 1.5]).corrections).plan
    assert len(found.rooms) == 2
    assert not found.doors
    return found


@pytest.mark.parametrize("form", FORMS)
def test_a_door_that_a_person_denied_is_no_cut_in_the_plan_of_an_export(
    denied: FloorPlan, form: str, tmp_path: Path
) -> None:
    if form == "dxf":
        pytest.importorskip("ezdxf")
    found = through(denied, form, tmp_path)
    assert not found.doors
    assert labels(found) == labels(denied)
    assert likeness(denied, found) > 0.99
    again = through(found, form, tmp_path / "again")
    assert not again.doors
    assert likeness(found, again) > 0.99


def test_a_closet_without_a_way_stays_a_room(tmp_path: Path) -> None:
    plan = two_rooms("house", width=0.6, label="Storage")
    closet = correct_plan(plan, Override(no_door=[0.75, 1.5]).corrections).plan
    assert closet.rooms[0].area < 2.0
    found = through(closet, "geojson", tmp_path)
    assert labels(found) == labels(closet)
    assert not found.doors


def test_a_drawing_of_somebody_else_still_gets_a_cut(denied: FloorPlan, tmp_path: Path) -> None:
    (text,) = geojson(denied).values()
    (tmp_path / "house.geojson").write_bytes(text.replace(b"states_ways", b"other"))
    (found,) = plans_of(tmp_path / "house.geojson")
    assert [door.kind for door in found.doors] == ["cut"]


def test_the_export_to_another_format_says_that_a_build_will_cut_a_way(denied: FloorPlan, tmp_path: Path) -> None:
    (tmp_path / "house.json").write_bytes(encode(denied))
    for form, is_said in (("sdf", True), ("geojson", False), ("pol", False)):
        said = call("export", tmp_path / "house.json", "--to", form, "--out", tmp_path / form)
        assert ("no way joins all parts of house" in said) == is_said


def test_the_export_to_a_map_says_that_a_build_may_make_open_rooms_one(tmp_path: Path) -> None:
    plan = two_rooms("house", width=4.0)
    middle, width, ring = ((4.15, 0.1), (4.15, 3.1)), 3.0, [(4.1, 0.1), (4.1, 3.1), (4.2, 3.1), (4.2, 0.1)]
    (door,) = plan.doors
    opening = replace(door, kind="opening", segment=middle, width=width, ring=ring)
    outline = [(0.1, 0.1), (0.1, 3.1), (7.2, 3.1), (7.2, 0.1)]
    (tmp_path / "house.json").write_bytes(encode(replace(plan, verts=outline, doors=(opening,))))
    for form, is_said in (("ros", True), ("png", True), ("sdf", False), ("npz", False)):
        said = call("export", tmp_path / "house.json", "--to", form, "--out", tmp_path / form)
        assert ("rooms meet in an opening of 2 m or more in house; " in said) == is_said
