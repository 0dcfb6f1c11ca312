"""What a review tells the fits: rooms and ways that are right and wrong, in the form of marks."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import msgspec
import pytest
import trimesh

pytest.importorskip("starlette")

from typer.testing import CliRunner

from houseexpo import build
from houseexpo.commands.app import make_app
from houseexpo.dataset.storey_labels import StoreyLabels
from houseexpo.errors import MissingDependencyError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.service.collection import Collection
from houseexpo.service.review.labels import labels_of
from houseexpo.service.review.requests import DecisionRequest
from houseexpo.service.review.session import Review, corrections_in, told_corrections
from houseexpo.service.review.sources import SourceView
from pipeline.batch.listing import list_inputs
from pipeline.cli_common import load_build_config
from pipeline.fitting.labels import Marked, read_labels
from pipeline.source_record import SourceReader
from pipeline.sources import reader
from pipeline.values import Level
from research.confidence_fit import of_reviewed
from tests.builders.bungalow import FILE
from tests.builders.houses import Hole, shell


@pytest.fixture(scope="module")
def view() -> SourceView:
    config = load_build_config(None, {"sources": (str(FILE),)})
    record = SourceReader(config, next(iter(list_inputs(config))).id).record({})
    return SourceView(record, record.levels[0], record.levels[0].plans[0])


def plan_of(view: SourceView) -> FloorPlan:
    assert view.plan is not None
    return view.plan


def in_source(plan: FloorPlan, x: float, y: float) -> list[float]:
    frame: Any = plan.frame
    found: list[float] = source_points_from_plan(frame, [(x, y)])[0].tolist()
    return found


def said_no_room(view: SourceView) -> tuple[FloorPlan, list[float]]:
    """The plan without its first room, and where that lies."""
    plan = plan_of(view)
    place = in_source(plan, *plan.rooms[0].polygon.representative_point().coords[0])
    return told_corrections(plan, corrections_in({"no_room": [place]}), view).plan, place


def test_a_house_that_was_kept_tells_of_all_its_parts(view: SourceView) -> None:
    plan = plan_of(view)
    found = labels_of(view, plan, is_kept=True)
    assert sorted(area for *_, area in found.rooms) == pytest.approx(
        sorted(r.polygon.area for r in plan.rooms), abs=0.01
    )
    assert len(found.ways) == sum(door.kind != "cut" for door in plan.doors)
    assert (found.unlike, found.no_ways) == ([], [])
    assert found.right is True
    assert labels_of(view, plan, is_kept=False).right is None


def test_a_correction_tells_what_was_wrong(view: SourceView) -> None:
    plan = plan_of(view)
    told, _ = said_no_room(view)
    found = labels_of(view, told, is_kept=False)
    assert [area for *_, area in found.no_rooms] == pytest.approx([plan.rooms[0].polygon.area], abs=0.01)
    assert found.rooms == []  # nobody spoke of the others
    every = labels_of(view, told, is_kept=True)
    assert (found.right, every.right) == (False, False)
    assert len(every.rooms) == len(plan.rooms) - 1


def test_rooms_of_the_building_beside_are_not_told_to_be_none(tmp_path: Path) -> None:
    door = [Hole(1.0, 1.9)]
    two = [*shell((0.0, 0.0, 6.0, 4.0), front=door), *translated(shell((0.0, 0.0, 6.0, 5.0), front=door), 20.0)]
    trimesh.util.concatenate(two).export(tmp_path / "two.ply")
    config = load_build_config(None, {"sources": (str(tmp_path / "two.ply"),)})
    record = SourceReader(config, next(iter(list_inputs(config))).id).record({})
    (level,) = record.levels
    assert len(level.plans) == 2
    for found in level.plans:
        view = SourceView(record, level, found)
        told = labels_of(view, plan_of(view), is_kept=True)
        assert len(view.spaces) >= 2
        assert (len(told.rooms), told.no_rooms) == (1, [])


def translated(parts: list[trimesh.Trimesh], along_x_m: float) -> list[trimesh.Trimesh]:
    return [part.copy().apply_translation((along_x_m, 0.0, 0.0)) for part in parts]


def test_labels_are_marks_of_the_storey_as_it_is_read(view: SourceView) -> None:
    told, _ = said_no_room(view)
    line = msgspec.json.encode(labels_of(view, told, is_kept=True))
    marked = msgspec.json.decode(line, type=Marked)
    (item,) = list_inputs(load_build_config(None, {"sources": (str(FILE),)}))
    (level,) = (each for each in reader(item.reader).read(item) if isinstance(each, Level))
    assert marked.is_of(level)
    assert marked.path == item.path
    assert sum(bool(each) for each in marked.judge_ways([(x, y) for x, y in marked.ways])) == len(marked.ways)  # type: ignore[arg-type]  # any array


@pytest.mark.slow
def test_the_command_writes_what_the_fits_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    build(FILE, tmp_path / "plans", workers=1)
    labels = tmp_path / "labels.jsonl"
    words = ["labels", str(tmp_path / "plans"), "--out", str(labels)]
    assert "0 storeys in" in (said := CliRunner().invoke(make_app(), words).output.replace("\n", ""))
    assert "nothing was reviewed: houseexpo review" in said
    review = Review(Collection("plans", tmp_path / "plans"))
    (name,) = review.queue.order
    plan = review.queue.dataset[name]
    point = plan.rooms[0].polygon.representative_point()
    review.decide(DecisionRequest(name, "no_room", "ann", points=[(point.x, point.y)]), "ann")
    review.decide(DecisionRequest(name, "keep", "ann", seen=1), "ann")
    done = CliRunner().invoke(make_app(), words)
    assert done.exit_code == 0, done.output
    assert "1 storey in" in done.output
    (line,) = labels.read_bytes().splitlines()
    found = msgspec.json.decode(line, type=StoreyLabels)
    assert len(found.no_rooms) >= 1
    assert len(found.rooms) == len(plan.rooms) - 1
    (item,) = read_labels(labels)
    rows = of_reviewed(item, labels)
    rooms = [part for part in rows.plans[0].parts if part.part == "room"]
    assert rows.plans[0].right is False
    assert sorted(part.true for part in rooms) == [False, *[True] * (len(plan.rooms) - 1)]


def test_without_the_packages_of_the_service_the_command_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "starlette", None)
    result = CliRunner().invoke(make_app(), ["labels", str(tmp_path), "--out", str(tmp_path / "labels.jsonl")])
    assert isinstance(result.exception, MissingDependencyError) or "labels needs starlette" in result.output
