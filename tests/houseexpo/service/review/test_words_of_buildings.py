"""Words said of one building of a level: the build makes the plan that the page shows, and leaves the others alone."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from shapely import box

from houseexpo.corrections import Override
from houseexpo.dataset import open_dataset
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan.json_codec import encode
from houseexpo.service.collection import Collection
from houseexpo.service.review.rebuild import compare_decided_plans
from houseexpo.service.review.requests import ReplaceRequest
from houseexpo.service.review.session import Review, corrections_in, told_corrections
from houseexpo.service.review.sources import SourceView
from pipeline.algorithm import plan_level
from pipeline.source_record import SourceReader
from tests.builders.batch import config_for, run_build

ROOMS = [(0, 0, 4, 4), (4.1, 0, 8, 4), (14, 0, 18, 4), (18.1, 0, 23, 4), (10, 1, 11.3, 2.3)]
"""Two buildings, the second one with a closet before it that stands alone, metres."""
SAID: dict[str, Any] = {
    "room": [[2.0, 2.0], [10.6, 1.6]],
    "room_outline": [[8.1, 2.5], [13.9, 2.5], [13.9, 3.9], [8.1, 3.9]],
    "label": [2.0, 2.0, "Kitchen"],
}
"""Words of the second building: two lie in and at the first one."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    rings = [[*map(list, box(*each).exterior.coords)] for each in ROOMS]
    shapes: list[tuple[str, Any, str]] = [("Polygon", [ring], "room") for ring in rings]
    shapes += [("LineString", [[x, 1], [x + 0.1, 1], [x + 0.1, 2], [x, 2], [x, 1]], "door") for x in (4, 18)]
    features = [
        {"type": "Feature", "properties": {"kind": kind}, "geometry": {"type": shape, "coordinates": points}}
        for shape, points, kind in shapes
    ]
    crs = {"properties": {"name": "LOCAL_CS metre"}}
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "pair.geojson").write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))
    return folder


def rooms(plan: FloorPlan) -> list[Any]:
    """Return the labels and bounds of rooms, in the source's axes."""
    frame: Any = plan.frame
    corners = [
        source_points_from_plan(frame, [room.ring.min(axis=0), room.ring.max(axis=0)]).round(2) for room in plan.rooms
    ]
    return sorted((room.label, *ends.ravel().tolist()) for room, ends in zip(plan.rooms, corners, strict=True))


def test_each_building_is_built_as_the_page_shows_it(folder: Path, tmp_path: Path) -> None:
    (level,) = SourceReader(config_for([folder]), "pair").record({"pair_B2": Override(**SAID)}).levels
    views = {found.id: SourceView(None, level, found) for found in level.plans}  # type: ignore[arg-type]  # not needed
    before = {name: view.plan for name, view in views.items() if view.plan is not None}
    tables = {"pair_B1": {}, "pair_B2": SAID}
    shown = {
        name: told_corrections(plan, corrections_in(tables[name]), views[name]).plan for name, plan in before.items()
    }
    run_build([folder], tmp_path / "out", overrides={"pair_B2": Override(**SAID)}, plan=plan_level)
    built = {plan.id: plan for plan in open_dataset(tmp_path / "out")}
    assert {name: rooms(plan) for name, plan in built.items()} == {name: rooms(plan) for name, plan in shown.items()}
    assert rooms(built["pair_B1"]) == rooms(before["pair_B1"])
    assert len(built["pair_B2"].rooms) == len(before["pair_B2"].rooms) + 3
    assert len((built["pair_B2"].provenance or {})["corrections"]) == 4


def test_the_list_names_each_changed_plan_and_what_is_not_as_it_was_shown(folder: Path, tmp_path: Path) -> None:
    def compared(shown: FloorPlan) -> dict[str, tuple[str, str]]:
        found = compare_decided_plans(tmp_path / "out", before, ["pair_B2"], {"pair_B2": shown})
        return {each.plan: (each.became, each.shown) for each in found}

    run_build([folder], tmp_path / "out", plan=plan_level)
    dataset = open_dataset(tmp_path / "out")
    before = {name: dataset.raw(name) for name in dataset.ids}
    plan = dataset["pair_B2"]
    assert compared(plan) == {"pair_B2": ("the same", "")}
    before["pair_B1"] = encode(plan)
    told = f"it is not as it was shown: 2 rooms, 0 doors, {plan.area:.1f} m2"
    assert compared(replace(plan, doors=())) == {"pair_B2": ("the same", told), "pair_B1": ("changed", "")}


def test_what_is_said_of_a_whole_storey_is_shown_at_its_building_and_taken_out_there(
    folder: Path, tmp_path: Path
) -> None:
    out, said = tmp_path / "out", {"label": [2.0, 2.0, "Kitchen"], "one_room": [[16.0, 2.0], [20.0, 2.0]]}
    run_build([folder], out, overrides={"pair": Override(**said)}, plan=plan_level)
    review = Review(Collection("out", out))
    review.decisions.decide("pair", "label", "ann", said["label"])
    review.decisions.decide("pair", "one_room", "ann", said["one_room"], seen=1)
    states = {name: review.state(name) for name in review.queue.order}
    assert {name: [each["word"] for each in found["effects"]] for name, found in states.items()} == {
        "pair_B1": ["label"],
        "pair_B2": ["one_room"],
    }
    assert {each["by"] for each in states["pair_B1"]["history"]} == {"ann"}
    asked = {"plan": "pair_B1", "word": "label", "value": said["label"], "seen": states["pair_B1"]["seen"]}
    found = review.replace(ReplaceRequest(reviewer="ben", **asked), "ben")
    assert found["effects"] == []
    assert review.decisions.tables() == {"pair": {"one_room": said["one_room"]}}
    assert [each["word"] for each in review.undo("ben", "pair_B1")["effects"]] == ["label"]
