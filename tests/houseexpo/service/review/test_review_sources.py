"""The source of plans on the page: read by the build's own command, for houses without a plan too, with file words."""

from __future__ import annotations

import math
import shutil
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import shapely
import trimesh

pytest.importorskip("starlette")
from starlette.testclient import TestClient

from houseexpo import build, open_dataset
from houseexpo.corrections import Correction, Override
from houseexpo.corrections.apply import correct_plan
from houseexpo.corrections.preview import preview
from houseexpo.dataset.source_records import LevelSource, Picture, Place, PlanSource, SourceRecord, Stroke
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Door, Room
from houseexpo.plan.json_codec import encode
from houseexpo.service.app import make_app
from houseexpo.service.collection import Collection
from houseexpo.service.review.line_questions import corner_lines
from houseexpo.service.review.question import Answer, Question, key_of, point_in
from houseexpo.service.review.questions import questions, with_effect
from houseexpo.service.review.sources import NoSuchLevelError, Sources, SourceView
from houseexpo.service.review.wall_ends import parts_between_gaps
from houseexpo.service.service import Service, ServiceSettings
from tests.builders.bungalow import FILE
from tests.builders.services import FRAME, box, two_rooms

PARTS = [[[0, 0, 0], [6, 0.2, 2.6]], [[0, 0, -0.1], [6, 5, 0]]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bungalow, and a wall on a slab, which is no plan."""
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    (tmp_path / "in").mkdir()
    shutil.copy(FILE, tmp_path / "in" / f"bungalow{FILE.suffix}")
    trimesh.util.concatenate([trimesh.creation.box(bounds=part) for part in PARTS]).export(tmp_path / "in" / "open.ply")
    build(tmp_path / "in", tmp_path / "houses", workers=1)
    return tmp_path / "houses"


@pytest.fixture
def client(folder: Path) -> Iterator[TestClient]:
    service = Service({"houses": Collection("houses", folder)}, ServiceSettings(review=True))
    with TestClient(make_app(service), base_url="http://127.0.0.1") as found:
        yield found


def state(client: TestClient, **query: str) -> dict[str, Any]:
    answer = client.get("/houses/review/state", params={"reviewer": "ann", **query})
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def post(client: TestClient, path: str, status: int = 200, **words: Any) -> dict[str, Any]:
    answer = client.post(f"/houses/review/{path}", json={"reviewer": "ann", **words})
    assert answer.status_code == status, answer.text
    return dict(answer.json())


@pytest.mark.slow
def test_the_source_of_a_plan_is_read_by_the_command_that_built_it(client: TestClient) -> None:
    before = state(client)
    assert not before["source"]["known"]
    assert before["source"]["why"] == ""
    found = client.get("/houses/review/source", params={"plan": before["plan"]}).json()
    assert {"section_1_1", "section_1_9"} <= {layer["name"] for layer in found["layers"]}
    x1, y1, x2, y2 = before["shape"]["bounds"]
    for layer in found["layers"]:
        a, b, c, d = layer["box"]
        assert a < x1 + 0.5
        assert b < y1 + 0.5
        assert c > x2 - 0.5
        assert d > y2 - 0.5
    assert found["edges"]
    after = state(client, plan=before["plan"])
    assert after["source"]["known"]
    assert not after["source"]["changed"]
    assert after["shape"]["rooms"] == before["shape"]["rooms"]
    assert client.get("/houses/review/source", params={"plan": "nobody"}).status_code == 404


@pytest.mark.slow
def test_a_house_without_a_plan_is_opened_and_finished(client: TestClient, folder: Path) -> None:
    ((name, why),) = state(client)["rejections"].items()
    opened = state(client, plan=name)
    assert (opened["plan"], opened["shape"], opened["rejected"]) == (name, None, why)
    asked = {"plan": name, "action": "room_outline", "points": [[0, 0], [0, 2], [2, 0]]}
    assert "its source is not read yet" in post(client, "decide", 400, **asked)["error"]
    assert client.get("/houses/review/source", params={"plan": name}).json()["layers"]
    shape = state(client, plan=name)["shape"]
    assert shape["rooms"] == []
    x1, y1, x2, y2 = shape["bounds"]
    x, y = (x1 + x2) / 2, (y1 + y2) / 2
    post(client, "decide", **{**asked, "points": [[x - 2, y - 1], [x - 2, y + 1], [x + 2, y + 1], [x + 2, y - 1]]})
    assert tomllib.loads((folder / "overrides.toml").read_text())[name]["room_outline"]
    assert not state(client, plan=name)["source"]["known"]  # it is read again with what is said
    client.get("/houses/review/source", params={"plan": name})
    found = state(client, plan=name)
    assert [round(room["area"]) for room in found["shape"]["rooms"]] == [8]
    assert found["effects"][0]["outcome"] == "done"
    build(folder.parent / "in", folder, workers=1)
    assert name in open_dataset(folder).ids


@pytest.mark.slow
def test_a_plan_that_is_drawn_stays_at_its_place_whatever_is_drawn_beside_it(client: TestClient, folder: Path) -> None:
    (name,) = state(client)["rejections"]

    def shown() -> tuple[Any, list[Any]]:
        under = client.get("/houses/review/source", params={"plan": name}).json()
        found = state(client, plan=name)
        assert np.array(found["frame"]) == pytest.approx(np.array(under["frame"]), abs=1e-3)
        return np.round(under["layers"][0]["box"], 3).tolist(), [room["rings"][0] for room in found["shape"]["rooms"]]

    client.get("/houses/review/source", params={"plan": name})
    post(client, "file", plan=name, key="units", value="m")
    box, _ = shown()
    (x, y) = np.mean(np.reshape(box, (2, 2)), axis=0).round(2).tolist()
    asked = {"plan": name, "action": "room_outline"}
    for left in (0.0, 2.2):  # the second one is the first of the plan, which would begin there
        corners = [[x - left + a, y + b] for a, b in ((0, 0), (0, 2), (2, 2), (2, 0))]
        post(client, "decide", **asked, points=corners, seen=state(client, plan=name)["seen"])
        assert not state(client, plan=name)["source"]["is_outdated"]  # the next one can be drawn
        at, rooms = shown()
        assert at == box
        assert np.min(rooms, axis=(0, 1)).tolist() == pytest.approx([x - left, y], abs=0.02)
    build(folder.parent / "in", folder, workers=1)
    assert np.min(shown()[1], axis=(0, 1)).tolist() == pytest.approx([x - 2.2, y], abs=0.02)
    post(client, "undo", plan=name)
    at, rooms = shown()
    assert at == box
    assert np.min(rooms, axis=(0, 1)).tolist() == pytest.approx([x, y], abs=0.02)


@pytest.mark.slow
def test_a_file_that_has_changed_is_told_and_what_was_said_of_it_is_a_ghost(client: TestClient, folder: Path) -> None:
    name = state(client)["plan"]
    client.get("/houses/review/source", params={"plan": name})
    x1, y1, _, _ = state(client, plan=name)["shape"]["bounds"]
    said = {"plan": name, "action": "label", "points": [[x1 + 2.0, y1 + 1.5]], "text": "Office"}
    assert not post(client, "decide", **said)["effects"][0].get("ghost")
    file = next((folder.parent / "in").glob("bungalow*"))
    file.write_text(file.read_text() + "\n# mended\n")
    assert not state(client, plan=name)["source"]["known"]  # the service that has read it sees it
    fresh = Service({"houses": Collection("houses", folder)}, ServiceSettings(review=True))
    with TestClient(make_app(fresh), base_url="http://127.0.0.1") as again:
        assert not state(again, plan=name)["source"]["changed"]  # nobody has looked yet
        again.get("/houses/review/source", params={"plan": name})
        found = state(again, plan=name)
        assert found["source"]["changed"]
        assert found["effects"][0]["ghost"]
        assert found["questions"][0]["key"].startswith("changed at ")


@pytest.mark.slow
def test_what_is_said_of_the_file_makes_another_reading(client: TestClient, folder: Path) -> None:
    name = state(client)["plan"]
    client.get("/houses/review/source", params={"plan": name})
    facts = state(client, plan=name)["source"]
    assert {"distance", "units", "scale", "up", "floors", "drop_nodes"} <= set(facts["takes"])
    bounds = state(client, plan=name)["shape"]["bounds"]
    x1 = bounds[0]
    post(client, "file", plan=name, key="distance", value="1", points=[[x1, 1.0], [x1 + 2.0, 1.0]])
    post(client, "file", plan=name, key="units", value="m")
    assert "distance" not in tomllib.loads((folder / "overrides.toml").read_text())[facts["file"]]
    post(client, "file", plan=name, key="scale", value="2")
    waits = state(client, plan=name)
    assert waits["source"]["is_outdated"]
    assert waits["questions"] == []
    assert waits["shape"]["bounds"] == bounds
    assert [step["keys"] for step in waits["history"]] == [["distance"], ["distance", "units"], ["scale", "units"]]
    said = {"plan": name, "action": "label", "points": [[x1 + 2.0, 1.5]], "text": "Office", "seen": waits["seen"]}
    assert "its file is read with what is said of it" in post(client, "decide", 400, **said)["error"]
    client.get("/houses/review/source", params={"plan": name})
    found = state(client, plan=name)
    assert "what is said of the file" in found["source"]["changed"]
    assert found["shape"]["bounds"][2] == pytest.approx(2 * bounds[2], rel=0.1)
    post(client, "decide", plan=name, seen=found["seen"], action="label", points=[[x1 + 4.0, 3.0]], text="Office")
    assert "Office" in {room["label"] for room in state(client, plan=name)["shape"]["rooms"]}
    post(client, "file", plan=name, key="units", value="")
    assert state(client, plan=name)["shape"]["bounds"] == found["shape"]["bounds"]  # as it was read last
    for value, what in (("x", "expected a number"), ("0", "expected more than 0"), ("nan", "finite")):
        client.get("/houses/review/source", params={"plan": name})
        assert what in post(client, "file", 400, plan=name, key="scale", value=value)["error"]


@pytest.mark.slow
def test_a_word_of_the_file_that_leaves_no_plan_is_told_and_the_source_is_shown(client: TestClient) -> None:
    before = state(client)
    name = before["plan"]
    client.get("/houses/review/source", params={"plan": name})
    x1, y1, x2, y2 = before["shape"]["bounds"]
    said = {"plan": name, "action": "label", "points": [[x1 + 2.0, y1 + 1.5]], "text": "Office"}
    post(client, "decide", **said, seen=state(client, plan=name)["seen"])
    post(client, "file", plan=name, key="scale", value="0.1")
    assert client.get("/houses/review/source", params={"plan": name}).json()["layers"]
    lost = state(client, plan=name)
    assert lost["source"]["known"]
    assert lost["source"]["changed"].startswith("With what is said of the file there is no plan now: source: ")
    assert (lost["rooms"], lost["shape"]["rooms"]) == (0, [])
    a, b, c, d = lost["shape"]["bounds"]
    assert max(c - a, d - b) < 0.3 * max(x2 - x1, y2 - y1)  # the source as it is read now, with a metre around it
    found = post(client, "undo", plan=name)
    assert found["undone"] == name
    client.get("/houses/review/source", params={"plan": name})
    found = state(client, plan=name)
    assert found["source"]["known"]
    assert [room["label"] for room in found["shape"]["rooms"]].count("Office") == 1
    assert not found["source"]["rejected"]


@pytest.mark.slow
def test_a_rejected_house_that_a_word_of_the_file_does_not_help_says_so(client: TestClient) -> None:
    (name,) = state(client)["rejections"]
    client.get("/houses/review/source", params={"plan": name})
    assert state(client, plan=name)["source"]["changed"] == ""
    post(client, "file", plan=name, key="scale", value="1.1")
    client.get("/houses/review/source", params={"plan": name})
    assert "there is no plan now: " in state(client, plan=name)["source"]["changed"]


def test_a_data_set_of_somebody_else_shows_no_source() -> None:
    def commands() -> list[list[str]]:
        raise ConfigError("built by somebody else")

    sources = Sources(commands)
    with pytest.raises(ConfigError, match="somebody else"):
        sources.read("house", {}, is_plan=True)
    assert sources.known("house", {}, is_plan=True) is None
    assert str(sources.why_not("house", {}, is_plan=True)) == "built by somebody else"


def test_a_command_that_fails_is_told_by_its_last_line() -> None:
    sources = Sources(lambda: [["/bin/sh", "-c", "echo one >&2; echo two >&2; exit 2", "", ""]])
    with pytest.raises(ConfigError, match="cannot be shown: two"):
        sources.read("house", {}, is_plan=True)


def test_a_level_that_is_gone_with_what_is_said_of_the_file_is_no_failure_of_reading(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, view = shown()
    sources = Sources(list)
    record = SourceRecord("house", levels=(msgspec.structs.replace(view.level, id="house_L0"),) * 2)
    monkeypatch.setattr(sources, "_record", lambda _: record)
    with pytest.raises(NoSuchLevelError, match="house_L0, of which the next build"):
        sources.read("house_B1", {}, is_plan=True)
    assert isinstance(sources.why_not("house_B1", {}, is_plan=True), NoSuchLevelError)


def test_a_file_is_read_once_for_all_its_storeys(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, view = shown()
    assert view.found is not None
    storeys = [
        msgspec.structs.replace(
            view.level,
            id=name,
            plans=(msgspec.structs.replace(view.found, id=name, plan=msgspec.Raw(encode(replace(plan, id=name)))),),
        )
        for name in ("house_L0", "house_L1")
    ]
    record = SourceRecord("house", levels=tuple(storeys))
    sources, read = Sources(list), list[str]()
    monkeypatch.setattr(sources, "_record", lambda name: read.append(name) or record)
    sources.read("house_L0", {}, is_plan=True)
    upper = sources.known(
        "house_L1", {"house_L0": {"keep": True}, "house_L1": {"door": [[1, 2], [2, 2]]}}, is_plan=True
    )
    assert upper is not None
    assert upper.plan is not None
    assert upper.plan.id == "house_L1"
    assert sources.known("house_L1", {"house": {"scale": 2.0}}, is_plan=True) is None
    sources.read("house_L1", {"house": {"scale": 2.0}}, is_plan=True)
    assert sources.known("house_L0", {"house": {"scale": 2.0}}, is_plan=True) is not None
    assert read == ["house_L0", "house_L1"]


def test_after_an_undo_of_the_scale_the_plan_is_that_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    plan, view = shown()
    rejected = SourceRecord("house", levels=(LevelSource("house", FRAME, rejected="403 x 406 m"),))
    sources, scaled, door = Sources(list), {"house": {"scale": 0.1}}, {"house": {"door": [[1, 2], [2, 2]]}}
    for record, said in ((view.record, {}), (rejected, scaled)):
        monkeypatch.setattr(sources, "_record", lambda _, record=record: record)
        sources.read("house", said, is_plan=True)
    assert sources.latest_with("house", scaled, is_plan=True) == sources.latest("house")
    for said in ({}, door):  # the scale is taken back, then a question is answered
        known = sources.known("house", said, is_plan=True)
        assert known is not None
        assert known.plan == plan
        assert sources.latest_with("house", said, is_plan=True) is None
    again = sources.known("house", scaled, is_plan=True)
    assert again is not None
    assert again.why_no_plan == "403 x 406 m"


def test_lines_along_the_edges_of_a_corner_that_juts_into_a_room() -> None:
    room = shapely.Polygon([(0, 0), (6, 0), (6, 3), (4, 3), (4, 5), (0, 5)])  # juts in at (4, 3)
    found = sorted([*map(tuple, line.coords)] for line in corner_lines(room)[1])
    assert [[tuple(round(v, 3) for v in at) for at in line] for line in found] == [
        [(4.0, 3.0), (0.0, 3.0)],
        [(4.0, 3.0), (4.0, 0.0)],
    ]
    assert corner_lines(shapely.box(0, 0, 4, 3)) == ([], [])
    hole = shapely.Polygon(box(0, 0, 6, 6), [box(2, 2, 4, 4)])
    assert len(corner_lines(hole)[1]) == 8
    assert all(line.within(hole.buffer(0.02)) for line in corner_lines(hole)[1])


def test_a_narrow_place_between_two_parts_of_a_room_is_asked_about() -> None:
    plan = replace(two_rooms("house"), frame=FRAME)
    ring = [(0.1, 0.1), (0.1, 3.1), (2.0, 3.1), (2.0, 1.1), (2.1, 1.1), (2.1, 3.1), (4.1, 3.1), (4.1, 0.1)]
    asked = questions(replace(plan, rooms=(Room(0, "Kitchen", ring), *plan.rooms[1:])))
    assert [each.answers[0].action for each in asked] == ["opening"]
    (a, b) = asked[0].answers[0].points
    assert abs(a[0] - b[0]) < 0.01
    assert abs(a[1] - b[1]) == pytest.approx(1.0)


def test_a_part_of_a_room_behind_a_wide_mouth_is_asked_about_and_then_what_else_parts_it() -> None:
    plan = replace(two_rooms("house"), frame=FRAME)
    ring = [(0.1, 0.1), (0.1, 3.1), (9.0, 3.1), (9.0, 0.1), (6.0, 0.1), (5.9, -3.0), (2.0, -3.0), (2.0, 0.2)]
    plan = replace(plan, rooms=(Room(0, "Hallway", [*ring, (1.7, 0.2), (1.7, 0.1)]),), doors=())
    mouth, *others = questions(plan)
    assert mouth.says == "A part of 12.2 m² is open to the rest here, for 4.00 m. Is it a room of its own?"
    assert sorted(x for x, _ in mouth.answers[0].points) == pytest.approx([2.0, 6.0], abs=0.1)
    assert others == []
    assert all("3.0" in each.says for each in questions(plan, {mouth.key}))  # across the hall
    post = replace(plan.rooms[0], holes=(box(3.9, 0.0, 4.1, 0.3),))
    assert [each.key for each in questions(replace(plan, rooms=(post,)))][:1] == [mouth.key]


def test_the_bend_of_a_corridor_is_no_narrow_place() -> None:
    ring = [(0.1, 0.1), (6.0, 0.1), (6.0, 5.0), (4.6, 5.0), (4.6, 1.5), (0.1, 1.5)]
    plan = replace(two_rooms("house"), frame=FRAME, rooms=(Room(0, "Hallway", ring),), doors=())
    assert questions(plan) == []
    hall = Room(0, "Hallway", [*ring[:2], (6.0, 5.0), (3.0, 5.0), (3.0, 1.5), (0.1, 1.5)])
    plan = replace(plan, rooms=(hall,))
    assert questions(plan) == []  # a corridor may be a part of its hall
    (several,) = questions(plan, several={key_of(plan, "room", point_in(hall))})
    assert several.area > 3.9


@pytest.mark.parametrize("jamb", [[], [(0.05, 0.05), (0.0, 0.1), (0.05, 0.15)], [(0.3, 0.05), (0.3, 0.15)]])
def test_a_doorway_is_a_narrow_place_whatever_its_jambs(jamb: list[tuple[float, float]]) -> None:
    """The jambs of a doorway of 1 m in a wall of 0.2 m are plain, a moulding, or a frame."""
    left = [(1.5, 3.0), *((1.5 + x, 3.0 + y) for x, y in jamb), (1.5, 3.2)]
    right = [(4.0 - x, y) for x, y in left[::-1]]
    ring = [
        (0.0, 0.0),
        (0.0, 3.0),
        *left,
        (0.0, 3.2),
        (0.0, 6.0),
        (4.0, 6.0),
        (4.0, 3.2),
        *right,
        (4.0, 3.0),
        (4.0, 0.0),
    ]
    plan = replace(two_rooms("house"), frame=FRAME, rooms=(Room(0, "Kitchen", ring),), doors=())
    (asked,) = questions(plan)
    (ax, ay), (bx, by) = asked.answers[0].points
    assert abs(ay - by) < 0.1
    assert 0.3 < abs(ax - bx) < 1.01


def test_a_deep_doorway_is_one_narrow_place_also_when_it_was_asked_about() -> None:
    ring = [(0.0, 0.0), (0.0, 3.0), (1.5, 3.0), (1.5, 3.9), (0.0, 3.9), (0.0, 7.0), (4.0, 7.0), (4.0, 3.9), (2.5, 3.9)]
    ring += [(2.5, 3.0), (4.0, 3.0), (4.0, 0.0)]
    plan = replace(two_rooms("house"), frame=FRAME, rooms=(Room(0, "Kitchen", ring),), doors=())
    (asked,) = questions(plan)
    assert asked.answers[0].title == "An opening"
    assert questions(plan, {asked.key}) == []


def test_a_doorway_with_two_jambs_is_asked_about_also_beside_another_door() -> None:
    plan = replace(two_rooms("house"), frame=FRAME)
    ring = [(0.1, 0.1), (0.1, 3.1), (2.0, 3.1), (2.0, 1.3), (2.1, 1.3), (2.1, 3.1), (4.1, 3.1), (4.1, 0.1), (2.1, 0.1)]
    ring += [(2.1, 0.3), (2.0, 0.3), (2.0, 0.1)]
    rooms = (Room(0, "Kitchen", ring), *plan.rooms[1:])
    beside = Door(1, "entrance", ((1.1, 0.05), (1.9, 0.05)), 0.8, box(1.1, 0.0, 1.9, 0.1), (0, None), 1.0)
    for doors in (plan.doors, (*plan.doors, beside)):
        (asked,) = questions(replace(plan, rooms=rooms, doors=doors))
        assert asked.key.startswith("corner")
        assert asked.at[1] == pytest.approx(0.8)


def shown(*places: Place, guesses: tuple[str, ...] = (), spaces: tuple[Any, ...] = ()) -> tuple[FloorPlan, SourceView]:
    """Two rooms whose passage is a cut, and their source, whose level frame is the plan's."""
    plan = replace(two_rooms("house"), frame=FRAME)
    plan = replace(plan, doors=tuple(replace(door, kind="cut", confidence=None) for door in plan.doors))
    found = PlanSource("house", msgspec.Raw(encode(plan)), spaces)
    level = LevelSource("house", FRAME, places=places, plans=(found,), guesses=guesses)
    return plan, SourceView(SourceRecord("house", levels=(level,), takes=("units", "up")), level, found)


def asked_of(plan: FloorPlan, view: SourceView, *closed: tuple[float, float]) -> list[str]:
    return [each.key.split(" at ")[0] for each in questions(plan, (), view, [("no_door", [each]) for each in closed])]


def test_a_place_for_a_door_is_asked_about_until_somebody_says_that_none_is_there() -> None:
    plan, view = shown(Place("door", ((4.15, 2.3), (4.15, 3.05))), Place("gap", ((0.05, 1.0), (0.05, 1.9))))
    assert asked_of(plan, view) == ["cut", "place", "place"]
    both = [each for each in questions(plan, (), view) if each.key.startswith("place")]
    assert [each.answers[0].action for each in both] == ["door", "entrance"]
    assert asked_of(plan, view, (4.1, 2.7)) == ["cut", "place"]
    assert with_effect(plan, both) == both


def test_no_entrance_is_asked_about_in_a_pocket_that_is_no_room() -> None:
    pocket = box(1.0, 1.0, 2.0, 2.0)
    plan, view = shown(Place("lintel", ((0.95, 1.15), (0.95, 1.85))), spaces=((tuple(map(tuple, pocket)),),))
    kitchen, bedroom = plan.rooms
    plan = replace(plan, rooms=(replace(kitchen, holes=(np.array(box(0.9, 0.9, 2.1, 2.1)),)), bedroom))
    assert sorted(asked_of(plan, view)) == ["cut", "place", "space"]
    assert asked_of(plan, view, (1.6, 1.5)) == ["cut"]  # somebody has said that the pocket is no room
    assert sorted(asked_of(plan, view, (3.0, 2.9))) == ["cut", "place", "space"]


def test_a_place_within_a_room_or_at_a_passage_is_not_asked_about() -> None:
    plan, view = shown(Place("door", ((2.0, 1.0), (2.0, 1.9))), Place("lintel", ((4.15, 1.1), (4.15, 1.9))))
    assert asked_of(plan, view) == ["cut"]


def test_a_cut_may_be_a_door_where_the_source_shows_one_and_the_plan_has_none() -> None:
    plan, view = shown(Place("gap", ((4.15, 2.3), (4.15, 3.05))))
    cut = plan.doors[0]
    (asked,) = (each for each in questions(plan, (), view) if each.key.startswith("cut"))
    assert asked.answers[-1].title == "A door where the gap is"
    door = replace(
        cut, id=1, kind="door", confidence=1.0, segment=((4.15, 2.3), (4.15, 3.05)), ring=box(4.1, 2.3, 4.2, 3.05)
    )
    (asked,) = (each for each in questions(replace(plan, doors=(cut, door)), (), view) if each.key.startswith("cut"))
    assert asked.answers[-1].action == "outside"


def test_an_open_leaf_in_a_room_is_no_door_in_place_of_a_cut() -> None:
    plan, view = shown(Place("door", ((4.3, 2.3), (4.9, 2.9))))
    (asked,) = (each for each in questions(plan, (), view) if each.key.startswith("cut"))
    assert asked.answers[-1].action == "outside"


def test_a_passage_round_a_corner_takes_no_place() -> None:
    plan, view = shown(Place("door", ((3.3, 3.15), (4.0, 3.15))))
    door = replace(plan.doors[0], kind="door", confidence=1.0, segment=((4.15, 2.4), (4.15, 3.0)), width=0.6)
    corner = replace(plan, doors=(replace(door, ring=box(4.1, 2.4, 4.2, 3.0)),))
    assert asked_of(corner, view) == ["place"]
    beside = replace(door, kind="entrance", rooms=(0, None), segment=((3.2, 3.15), (3.9, 3.15)))
    assert asked_of(replace(plan, doors=(replace(beside, ring=box(3.2, 3.1, 3.9, 3.2)),)), view) == []


def test_a_space_that_was_left_out_may_be_a_room_with_a_door() -> None:
    closet = ((tuple(map(tuple, box(7.3, 0.1, 9.3, 3.1))),),)

    def answers(*places: Place) -> list[Answer]:
        plan, view = shown(*places, spaces=closet)
        (asked,) = (each for each in questions(plan, (), view) if each.key.startswith("space"))
        return list(asked.answers)

    *_, to_room = answers()
    assert to_room.title == "A room with a door to the largest one beside it"
    (door,) = to_room.then
    assert door.action == "door"
    assert sorted(door.points) == [(7.3, 1.2), (7.3, 2.0)]
    *_, at_gap = answers(Place("gap", ((7.25, 0.3), (7.25, 1.1))))
    assert at_gap.then[0].points == ((7.25, 0.3), (7.25, 1.1))
    *_, outside = answers(Place("gap", ((9.35, 0.3), (9.35, 1.1))))
    assert outside.then[0].action == "entrance"


def test_a_narrow_place_is_asked_about_between_rooms_that_no_passage_joins() -> None:
    plan, view = shown(Place("lintel", ((4.15, 2.3), (4.15, 2.65))), Place("lintel", ((0.05, 1.0), (0.05, 1.35))))
    assert asked_of(plan, view) == ["cut", "place"]
    doors = tuple(replace(door, kind="door", confidence=1.0) for door in plan.doors)
    assert asked_of(replace(plan, doors=doors), view) == []


def test_a_place_beside_a_narrow_room_is_a_door_of_it() -> None:
    plan, view = shown(Place("lintel", ((4.15, 2.3), (4.15, 3.05))))
    bedroom = plan.rooms[1].polygon
    narrow = replace(plan.rooms[1], ring=shapely.get_coordinates(bedroom.intersection(shapely.box(4, 0, 4.6, 4)))[:-1])
    (asked,) = (
        each for each in questions(replace(plan, rooms=(plan.rooms[0], narrow)), (), view) if "place" in each.key
    )
    assert asked.answers[0].action == "door"


def test_what_hangs_before_a_wall_is_no_place() -> None:
    plan, view = shown(Place("lintel", ((-0.3, 1.0), (-0.3, 1.9))), Place("lintel", ((0.05, 2.0), (0.05, 2.9))))
    assert view.found is not None
    assert asked_of(plan, view) == ["cut", "place", "place"]
    outer = tuple(tuple((x, y) for x, y in box(0.0, low, 0.1, high)) for low, high in ((0.0, 2.0), (2.9, 3.2)))
    walled = replace(view, found=msgspec.structs.replace(view.found, walls=tuple((ring,) for ring in outer)))
    (asked,) = (each for each in questions(plan, (), walled) if each.key.startswith("place"))
    assert asked.at == (0.05, 2.45)
    assert [ends for _, ends in walled._offered] == [[[0.05, 2.0], [0.05, 2.9]]]


def test_a_place_that_would_part_a_room_is_asked_about() -> None:
    plan, view = shown(Place("lintel", ((2.0, 1.0), (2.0, 3.1))))
    (asked,) = (each for each in questions(plan, (), view) if each.key.startswith("corner"))
    assert [answer.action for answer in asked.answers] == ["opening", "leave", "wall"]
    assert with_effect(plan, [asked]) == [asked]
    assert len(plan.corrected(said_of(plan, asked.answers[0])).plan.rooms) == 3


def test_what_the_source_shows_as_high_as_a_wall_is_asked_about_where_it_would_part_a_room() -> None:
    plan, view = shown()
    seen = (((2.0, 1.2), (2.0, 3.1)), ((0.1, 0.2), (3.0, 0.2)), ((4.15, 0.1), (4.15, 3.1)), ((1.0, 1.4), (1.4, 1.4)))
    view = SourceView(view.record, msgspec.structs.replace(view.level, seen=seen), view.found)
    (asked,) = (each for each in questions(plan, (), view) if each.key.startswith("wall"))
    assert asked.answers[0].points == ((2.0, 1.2), (2.0, 3.1))
    assert "wall" not in [
        each.key.split(" ")[0] for each in questions(plan, [asked.key.replace("wall", "corner")], view)
    ]
    for word, is_asked in (("no_wall", False), ("wall", True)):
        again = questions(plan, (), view, [(word, [(2.1, 1.0), (2.1, 3.0)])])
        assert any(each.key == asked.key for each in again) == is_asked
    stub = plan.corrected(said_of(plan, asked.answers[0])).plan
    (narrow,) = (each for each in questions(stub, (), view) if each.answers[0].action == "opening")
    assert len(stub.corrected(said_of(stub, narrow.answers[0])).plan.rooms) == 3
    assert not [each for each in questions(stub, (), view) if each.key.startswith("wall")]


def test_a_room_that_takes_a_part_of_the_space_between_its_walls_is_asked_about() -> None:
    plan, view = shown(spaces=((((-1.4, 0.1), (4.1, 0.1), (4.1, 3.1), (-1.4, 3.1)),),))
    (asked,) = (each for each in questions(plan, (), view) if each.key.startswith("larger"))
    assert "enclose 16.5 m², and this kitchen has 12.0 m²" in asked.says
    whole = plan.corrected(said_of(plan, asked.answers[0])).plan
    assert sorted(round(room.area, 1) for room in whole.rooms) == [9.0, 16.5]
    assert "larger" not in asked_of(whole, view)
    beside = (((-1.4, 0.1), (7.2, 0.1), (7.2, 3.1), (-1.4, 3.1)),)  # most of it is another room
    assert "larger" not in asked_of(*shown(spaces=(beside,)))


def test_a_space_that_only_gaps_leave_open_is_asked_about_and_becomes_a_room() -> None:
    plan, view = shown()
    assert view.found is not None
    around = shapely.difference(shapely.box(7.2, 0.0, 10.0, 3.2), shapely.box(7.3, 0.1, 9.9, 3.1))
    rings = tuple(tuple(ring.coords[:-1]) for ring in (around.exterior, *around.interiors))
    found = msgspec.structs.replace(view.found, standing=(rings,))
    view = SourceView(view.record, view.level, found)
    (asked,) = (each for each in questions(plan, (), view) if each.key.startswith("space"))
    assert "of 7.8 m² between walls" in asked.says
    said = said_of(plan, asked.answers[0]).corrections
    assert len(correct_plan(plan, said, standing=view.standing).plan.rooms) == 3
    assert len(correct_plan(plan, said).plan.rooms) == 2


def said_of(plan: FloorPlan, answer: Answer) -> Override:
    points = source_points_from_plan(plan.frame, answer.points).round(3).tolist()  # type: ignore[arg-type]
    return Override(**{answer.action: points[0] if len(points) == 1 else points})


def test_a_question_whose_answer_does_nothing_is_not_asked() -> None:
    plan, view = shown()
    nothing = Question(
        "place at 9.0, 2.0", (9.0, 2.0), "?", (Answer("A door", "door", ((9.0, 2.0), (9.9, 2.0))), Answer("None")), 0.9
    )
    assert with_effect(plan, [nothing, *questions(plan, (), view)])[0].key.startswith("cut")
    assert with_effect(plan, [nothing]) == []


def test_what_was_guessed_of_the_file_is_asked_first() -> None:
    plan, view = shown(guesses=("units", "up"))
    first = questions(plan, (), view)[0]
    assert "does not say the unit and the upward axis" in first.says
    defaults = (("scale", "1"), ("storey_height", ""), ("units", "auto"), ("up", "auto"))
    unsaid = replace(view, record=msgspec.structs.replace(view.record, options=defaults))
    assert questions(plan, (), unsaid)[0] == first
    assert [answer.action for answer in first.answers] == ["leave", "up", "file"]
    assert first.answers[1].text == "y"
    sized = replace(view, record=msgspec.structs.replace(view.record, unit_m=1.0, other_units_m=(0.0254, 2.0)))
    by_key = [each for each in questions(plan, (), sized)[0].answers if each.action == "units"]
    assert [(each.title, each.text) for each in by_key] == [("0.2 m x 0.1 m", "in"), ("14.2 m x 6.0 m", "2")]


def test_a_size_that_the_file_states_is_asked_about_if_another_is_clearly_likelier() -> None:
    plan, view = shown()
    plan = replace(plan, doors=tuple(replace(door, kind="door", confidence=1.0) for door in plan.doors))
    assert asked_of(plan, view) == []
    odd = replace(view, record=msgspec.structs.replace(view.record, unit_m=1.0, other_units_m=(2.0,), is_odd=True))
    (asked,) = questions(plan, (), odd)
    assert "The sizes in this file are unusual; this storey is 7.1 m x 3.0 m so" in asked.says
    assert "its doors are 0.80 m wide" in asked.says
    assert asked.answers[1] == Answer("14.2 m x 6.0 m, doors 1.60 m", "units", text="2")
    assert questions(plan, [asked.key], odd) == []
    said = replace(odd, record=msgspec.structs.replace(odd.record, options=(("units", "1"),)))
    assert asked_of(plan, said) == []


def test_the_floors_are_asked_about_with_their_heights() -> None:
    plan, view = shown()
    level = msgspec.structs.replace(view.level, extent=(7.1, 3.0), frame=replace(FRAME, floor=-1e-9))
    upper = msgspec.structs.replace(level, id="up", frame=replace(FRAME, floor=2.8), rejected="layout: not_enclosed")
    record = msgspec.structs.replace(view.record, levels=(level, upper), takes=("floors",), other_floors=(6.0,))
    found = replace(view, level=level, record=record)
    first = questions(plan, (), found)[0]
    assert first.says.startswith(
        "Floors were found at 0.00 m and 2.80 m, and level surfaces with walls on them at 6.00 m."
    )
    assert [(each.action, each.text) for each in first.answers] == [
        ("leave", ""),
        ("floors", "0, 2.8, 6"),
        ("floors", "2.8"),
        ("floors", "0"),
        ("file", ""),
    ]
    sure = msgspec.structs.replace(record, levels=(level, msgspec.structs.replace(upper, rejected="")), other_floors=())
    assert asked_of(plan, replace(found, record=sure)) == ["cut"]
    told = msgspec.structs.replace(record, options=(("floors", "[0]"),))
    assert asked_of(plan, replace(found, record=told)) == ["cut"]


def test_what_somebody_said_of_the_file_is_not_asked() -> None:
    plan, view = shown(guesses=("units", "scale", "up", "levels"))
    for said, asks in (("units", "the upward axis; "), ("storey_height", "the upward axis; ")):
        told = replace(view, record=msgspec.structs.replace(view.record, options=((said, "1.5"),)))
        assert f"does not say {asks}" in questions(plan, (), told)[0].says
    told = replace(
        view, record=msgspec.structs.replace(view.record, options=(("scale", "2"), ("up", "z"), ("floors", "[0]")))
    )
    assert asked_of(plan, told) == ["cut"]


def test_a_space_that_was_left_out_is_asked_about() -> None:
    plan, view = shown(
        spaces=(
            (((8.0, 0.1), (8.0, 3.1), (10.0, 3.1), (10.0, 0.1)),),
            (((0.1, 0.1), (0.1, 3.1), (4.1, 3.1), (4.1, 0.1)),),
        )
    )
    assert sorted(asked_of(plan, view)) == ["cut", "space"]  # the other one is a room of the plan
    assert asked_of(plan, view, (9.0, 2.0)) == ["cut"]  # somebody has said that it is none


def test_a_room_of_another_building_of_the_storey_is_no_space_that_was_left_out() -> None:
    plan, view = shown(spaces=((((8.0, 0.1), (8.0, 3.1), (10.0, 3.1), (10.0, 0.1)),),))
    moved = replace(FRAME, matrix=((1.0, 0.0, 18.0), (0.0, 1.0, -2.0)))  # 8 m to the right
    beside = replace(plan, id="other", rooms=(Room(0, "Kitchen", box(0.0, 0.1, 2.0, 3.1)),), doors=(), frame=moved)
    other = PlanSource("other", msgspec.Raw(encode(beside)))
    level = msgspec.structs.replace(view.level, plans=(*view.level.plans, other))
    record = msgspec.structs.replace(view.record, levels=(level,))
    assert asked_of(plan, SourceView(record, level, view.found)) == ["cut"]


@pytest.mark.parametrize(("floor", "asked"), [(-1.4, ["cut"]), (-2.8, ["cut", "space"]), (1.4, ["cut"])])
def test_a_room_of_a_wing_half_a_storey_higher_or_lower_is_no_space_that_was_left_out(
    floor: float, asked: list[str]
) -> None:
    plan, view = shown(spaces=((((8.0, 0.1), (8.0, 3.1), (10.0, 3.1), (10.0, 0.1)),),))
    frame = replace(FRAME, matrix=((1.0, 0.0, 18.0), (0.0, 1.0, -2.0)), floor=floor)
    wing = replace(plan, id="wing", rooms=(Room(0, "Kitchen", box(0.0, 0.1, 2.0, 3.1)),), doors=(), frame=frame)
    own = msgspec.structs.replace(view.level, ceiling_m=2.5)
    other = LevelSource("wing", frame, plans=(PlanSource("wing", msgspec.Raw(encode(wing))),), ceiling_m=2.5)
    record = msgspec.structs.replace(view.record, levels=(own, other))
    assert sorted(asked_of(plan, SourceView(record, own, view.found))) == asked


def test_a_place_that_cannot_be_taken_is_not_offered() -> None:
    far, between = Place("gap", ((12.0, 1.0), (12.0, 1.9))), Place("door", ((4.15, 2.3), (4.15, 3.05)))
    _, view = shown(far, between)
    assert [place["ends"] for place in view.drawn_under(view.plan)["places"]] == [[[4.15, 2.3], [4.15, 3.05]]]


def test_places_are_tried_once_for_all_plans_of_a_source(monkeypatch: pytest.MonkeyPatch) -> None:
    _, view = shown(Place("door", ((4.15, 2.3), (4.15, 3.05))))
    first = view.drawn_under(view.plan)
    monkeypatch.delattr("houseexpo.service.review.sources.correct_plan")
    assert view.drawn_under(view.plan) == first


def test_the_source_lies_under_a_plan_that_starts_elsewhere() -> None:
    plan, view = shown(Place("door", ((4.15, 2.3), (4.15, 3.05))))
    x, y = source_points_from_plan(plan.frame, [[0.0, 0.0]])[0].tolist()
    corners = [[x - 3.0, y + 0.2], [x - 0.1, y + 0.2], [x - 0.1, y + 3.0], [x - 3.0, y + 3.0]]
    larger = plan.corrected(Override(room_outline=corners)).plan
    assert larger.bbox[0] == 0.1
    (before,), (after,) = (view.drawn_under(each)["places"] for each in (plan, larger))
    moved = larger.rooms[0].polygon.bounds[0] - plan.rooms[0].polygon.bounds[0]
    assert moved > 2.0
    assert [x - moved for x, _ in after["ends"]] == pytest.approx([x for x, _ in before["ends"]])
    x1, *_ = view.bounds_around(plan)
    assert view.bounds_around(larger)[0] == pytest.approx(x1 + moved)


def arena(*spans: tuple[float, float], shows: tuple[Place, ...] = (), sides: int = 4) -> tuple[FloorPlan, SourceView]:
    """Two rooms of 4 x 6 m with a wall between them, at x = 4.0 to 4.1, which is open from y to y for each span.

    The source shows this wall and ``sides`` of the outer walls; the last one is at the left.
    """
    rooms = tuple(Room(k, "Unlabelled", box(x, 0.0, x + 4.0, 6.0)) for k, x in enumerate((0.0, 4.1)))
    doors = tuple(
        Door(k, "opening", ((4.05, a), (4.05, b)), round(b - a, 2), box(4.0, a, 4.1, b), (0, 1), 0.98)
        for k, (a, b) in enumerate(spans)
    )
    whole = shapely.union_all([each.polygon for each in (*rooms, *doors)])
    holes = tuple(list(ring.coords[:-1]) for ring in whole.interiors)
    plan = FloorPlan("house", list(whole.exterior.coords[:-1]), 2, {}, holes, rooms=rooms, doors=doors, frame=FRAME)
    wall = shapely.difference(shapely.box(4.0, 0.0, 4.1, 6.0), shapely.union_all([door.polygon for door in doors]))
    outer = [box(0.0, 6.0, 8.1, 6.1), box(0.0, -0.1, 8.1, 0.0), box(8.1, 0.0, 8.2, 6.0), box(-0.1, 0.0, 0.0, 6.0)]
    parts = [*(list(part.exterior.coords[:-1]) for part in shapely.get_parts(wall).tolist()), *outer[:sides]]
    walls = tuple((tuple(part),) for part in parts)
    found = PlanSource("house", msgspec.Raw(encode(plan)), walls=walls)
    picture = Picture("map", "The map", plan.bbox, b"")
    level = LevelSource("house", FRAME, (picture,), places=shows, plans=(found,))
    return plan, SourceView(SourceRecord("house", levels=(level,)), level, found)


def test_a_line_of_the_file_that_is_shown_lies_within_the_bounds() -> None:
    plan, view = arena((2.0, 3.0))
    level = msgspec.structs.replace(view.level, strokes=(Stroke("WALL", ((30.0, 0.0), (30.0, 4.0))),))
    _, _, x2, _ = SourceView(view.record, level, view.found).bounds_around(plan)
    assert x2 == 30.0


def plan_of(one: Room, other: Room, plan: FloorPlan) -> FloorPlan:
    """The plan with two other rooms."""
    whole = shapely.union_all([each.polygon for each in (one, other, *plan.doors)])
    holes = tuple(list(ring.coords[:-1]) for ring in whole.interiors)
    return replace(plan, verts=list(whole.exterior.coords[:-1]), holes=holes, rooms=(one, other))


def test_rooms_that_are_open_to_each_other_may_be_one() -> None:
    assert asked_of(*arena((2.0, 2.9))) == []
    assert asked_of(*arena((0.0, 5.0))) == ["parted"]
    plan, view = arena((0.5, 1.4), (4.0, 5.5))
    (asked,) = questions(plan, (), view)
    assert "2 passages join them" in asked.says
    assert [answer.action for answer in asked.answers] == ["one_room", "leave", "no_door", "no_door"]
    assert asked.answers[2].title.endswith("the way of 0.90 m")
    gone = source_points_from_plan(plan.frame, asked.answers[2].points).tolist()
    assert [door.width for door in plan.corrected(Override(no_door=gone)).plan.doors] == [0.9]
    assert questions(plan) == []  # what the source shows is not known
    assert questions(plan, [asked.key], view) == []
    sure = tuple(replace(door, confidence=1.0) for door in plan.doors)
    assert questions(replace(plan, doors=sure), (), view) == []  # somebody has said that they are passages
    one, other = source_points_from_plan(plan.frame, asked.answers[0].points).tolist()
    joined = plan.corrected(Override(one_room=[one, other])).plan
    assert len(joined.rooms) == 1
    assert "parted" not in asked_of(joined, view)


def test_a_room_along_whose_edge_the_source_shows_no_wall_may_be_none() -> None:
    assert asked_of(*arena((2.0, 2.9))) == []
    plan, view = arena((2.0, 2.9), sides=3)  # a wall beside 14 of 20 m of the left room's edge
    (asked,) = questions(plan, (), view)
    assert "The map shows no wall along" in asked.says
    assert asked.at[0] < 4.0
    assert [answer.action for answer in asked.answers] == [*("leave", "no_room", "outside", "leave", "one_room")]
    assert questions(plan, [asked.key], view) == []
    said = tuple(replace(room, confidence=1.0) for room in plan.rooms)
    assert questions(replace(plan, rooms=said), (), view) == []
    assert questions(plan) == []
    drawing = msgspec.structs.replace(view.level, pictures=())
    assert asked_of(plan, SourceView(view.record, drawing, view.found)) == ["front"]


def test_a_space_with_walls_at_two_sides_may_be_a_porch() -> None:
    plan, view = arena((2.0, 2.9), sides=2)
    drawing = msgspec.structs.replace(view.level, pictures=())
    kinds = asked_of(plan, SourceView(view.record, drawing, view.found))
    assert "seen" not in kinds  # each room lacks one side
    bare = msgspec.structs.replace(view.found, walls=view.found.walls[:1])  # type: ignore[union-attr]
    found = SourceView(view.record, drawing, bare)
    asked = [each for each in questions(plan, (), found) if each.key.startswith("seen")]
    assert [each.says[:31] for each in asked] == ["The source shows no wall along "] * 2


def test_a_bay_of_a_map_around_which_no_wall_is_seen_can_be_shut_off_by_one_key() -> None:
    """Rays went through a gap of 1 m in the right wall, and saw 2 m x 2 m behind it."""
    plan, view = arena((2.0, 2.9))
    left, right = plan.rooms
    outline = [(4.1, 0.0), (8.1, 0.0), (8.1, 2.0), (8.3, 2.0), (8.3, 1.0), (10.3, 1.0), (10.3, 4.0), (8.3, 4.0)]
    outline += [(8.3, 3.0), (8.1, 3.0), (8.1, 6.0), (4.1, 6.0)]
    with_bay = replace(right, ring=outline)
    plan = plan_of(left, with_bay, plan)
    view = SourceView(view.record, view.level, msgspec.structs.replace(view.found, plan=msgspec.Raw(encode(plan))))  # type: ignore[type-var]
    (asked,) = [each for each in questions(plan, (), view) if each.key.startswith("bay")]
    assert asked.area == pytest.approx(6.0, abs=0.4)
    assert asked.at[0] > 8.3
    assert [answer.action for answer in asked.answers] == ["wall", "leave", "opening", "door"]
    assert questions(plan, (), view, [("one_room", [asked.at, (6.0, 3.0)])]) == []
    ends = tuple(map(tuple, source_points_from_plan(plan.frame, asked.answers[0].points).tolist()))
    found = preview(plan, [Correction("wall", ends)], view.plan, view.spaces, view.standing, walls=view.walls).plan
    assert sorted(round(room.area) for room in found.rooms) == [6, 24, 24]
    assert questions(plan, [asked.key], view) == []


def test_a_wall_that_stands_free_may_part_two_rooms_by_one_key() -> None:
    plan, view = arena((2.0, 2.9))
    left, right = plan.rooms
    hole = [(6.0, 2.0), (6.1, 2.0), (6.1, 4.0), (6.0, 4.0)]
    plan = plan_of(left, replace(right, holes=(hole,)), plan)
    view = SourceView(view.record, view.level, msgspec.structs.replace(view.found, plan=msgspec.Raw(encode(plan))))  # type: ignore[type-var]
    (asked,) = [each for each in questions(plan, (), view) if each.key.startswith("corner")]
    assert "with 2 gaps of 2.00 and 2.00 m" in asked.says
    assert with_effect(plan, [asked], (), view) == [asked]
    lines = [asked.answers[0].points, *asked.answers[0].more]
    for words, ways in (([("opening", line) for line in lines], 2), (one_way(asked), 1)):
        said = [
            Correction(word, tuple(map(tuple, source_points_from_plan(plan.frame, line).tolist())))  # type: ignore[arg-type]
            for word, line in words
        ]
        parted = preview(plan, said, view.plan, view.spaces, view.standing, walls=view.walls)
        assert [record["outcome"] for record in parted.records] == ["done", "done"]
        assert [len(parted.plan.rooms), len(parted.plan.doors)] == [3, len(plan.doors) + ways]
    joined = [("one_room", [(5.0, 1.0), (7.0, 1.0)])]
    assert asked.key not in [each.key for each in questions(plan, (), view, joined)]
    block = [(6.0, 2.0), (7.0, 2.0), (7.0, 4.0), (6.0, 4.0)]  # what corridors go round is no wall
    around = plan_of(left, replace(right, holes=(block,)), plan)
    assert not [each for each in questions(around, (), view) if "gaps" in each.says]


def one_way(asked: Question) -> list[tuple[str, Any]]:
    answer = asked.answers[2]
    return [(answer.action, answer.points), (answer.then[0].action, answer.then[0].points)]


def test_a_closet_has_no_parts() -> None:
    closet = shapely.Polygon([(0, 0), (1, 0), (1, 0.9), (0.55, 0.9), (0.55, 0.5), (0.5, 0.5), (0.5, 0.9), (0, 0.9)])
    assert parts_between_gaps(closet.wkb) == ()


@pytest.mark.parametrize(("x", "asked"), [(4.5, "2 gaps of 0.40 and 1.50 m"), (4.3, "a gap of 1.50 m")])
def test_walls_that_end_in_a_room_part_it_together(x: float, asked: str) -> None:
    plan = replace(two_rooms("house"), frame=FRAME)
    walls = [(4.0, 0.1, 4.1, 2.0), (4.0, 3.5, 4.1, 6.0), (x, 4.0, 8.0, 4.1)]  # a slit of 0.2 m is wall
    shape = shapely.difference(
        shapely.box(0.1, 0.1, 8.0, 6.0), shapely.union_all([shapely.box(*wall) for wall in walls])
    )
    plan = replace(plan, rooms=(Room(0, "Hall", list(shape.exterior.coords)[:-1]),), doors=())
    *alone, part = sorted(questions(plan), key=lambda each: each.key.startswith("corner of a part"))
    assert 1.5 in [round(math.dist(*each.answers[0].points), 1) for each in alone]
    assert f"with {asked}. Is it a room of its own?" in part.says
    assert with_effect(plan, [part]) == [part]
    answer = part.answers[0]
    words = [*((answer.action, line) for line in (answer.points, *answer.more))]
    words += [(further.action, further.points) for further in answer.then]
    said = [
        Correction(word, tuple(map(tuple, source_points_from_plan(FRAME, line).tolist())))  # type: ignore[arg-type]
        for word, line in words
    ]
    found = correct_plan(plan, said)
    assert {effect.outcome for effect in found.effects} == {"done"}
    assert sorted(round(room.area) for room in found.plan.rooms) == [7, 15, 23]


def test_a_side_of_a_room_without_a_wall_may_be_open_to_the_outside() -> None:
    plan, view = arena((2.0, 2.9), sides=3)
    mouth = Place("lintel", ((-0.05, 1.0), (-0.05, 5.0)))
    drawing = msgspec.structs.replace(view.level, pictures=())
    view = SourceView(view.record, drawing, view.found)
    (asked,) = questions(plan, (), view)
    assert asked.key.startswith("front")
    assert [answer.action for answer in asked.answers] == ["entrance", "leave"]
    assert with_effect(plan, [asked], (), view) == [asked]
    ends = tuple(map(tuple, source_points_from_plan(plan.frame, asked.answers[0].points).tolist()))
    opened = preview(plan, [Correction("entrance", ends)], view.plan, view.spaces, view.standing, walls=view.walls).plan
    assert [door.kind for door in opened.doors] == ["opening", "entrance"]
    assert asked_of(opened, view) == []
    assert questions(plan, [asked.key], view) == []
    whole, closed = arena((2.0, 2.9))
    shown = msgspec.structs.replace(closed.level, pictures=(), places=(mouth,))
    assert asked_of(whole, SourceView(closed.record, shown, closed.found)) == []  # a wall stands there
    assert "front" in asked_of(replace(plan, doors=()), view)
    narrow = msgspec.structs.replace(drawing, places=(Place("lintel", ((-0.05, 2.0), (-0.05, 3.0))),))
    assert "front" in asked_of(plan, SourceView(view.record, narrow, view.found))
    for far_m, count in ((0.1, 0), (1.0, 1)):  # a face in the section is a wall, although nothing was taken for one
        low = msgspec.structs.replace(drawing, seen_low=(((-far_m, 0.0), (-far_m, 6.0)),), places=(mouth,))
        assert asked_of(plan, SourceView(view.record, low, view.found)).count("front") == count


def test_a_wide_door_that_the_source_names_is_asked_about_as_such() -> None:
    plan, view = arena((2.0, 2.9), sides=3)
    gate = Place("door", ((-0.05, 1.0), (-0.05, 4.0)))
    view = SourceView(view.record, msgspec.structs.replace(view.level, pictures=(), places=(gate,)), view.found)
    (asked,) = questions(plan, (), view)
    assert asked.says.startswith("The source names a door here, 3.00 m wide.")


def test_an_open_mouth_as_wide_as_a_corridor_is_asked_about() -> None:
    plan, view = arena((2.0, 2.9), sides=3)
    shown = msgspec.structs.replace(
        view.level, pictures=(), places=(Place("floor_edge", ((-0.05, 2.0), (-0.05, 3.4))),)
    )
    assert view.found is not None
    walls = tuple((tuple(map(tuple, box(-0.1, a, 0.0, b))),) for a, b in ((0.0, 2.0), (3.4, 6.0)))
    found = msgspec.structs.replace(view.found, walls=(*view.found.walls, *walls))
    view = SourceView(view.record, shown, found)
    (asked,) = questions(plan, (), view)
    assert "1.40 m wide. Is it open to the outside" in asked.says
    assert with_effect(plan, [asked], (), view) == [asked]
    assert questions(plan, (), view, [("room_outline", box(0.0, 0.0, 4.0, 6.0))]) == []  # somebody drew this edge


def test_rooms_between_which_the_source_shows_doors_are_not_asked_about() -> None:
    one, other = Place("door", ((4.05, 0.5), (4.05, 1.4))), Place("lintel", ((4.05, 4.0), (4.05, 5.5)))
    assert asked_of(*arena((0.5, 1.4), (4.0, 5.5), shows=(one, other))) == []
    assert asked_of(*arena((0.0, 5.0), shows=(Place("lintel", ((4.05, 0.0), (4.05, 5.0))),))) == []
    gap = Place("gap", ((4.05, 0.5), (4.05, 1.4)))
    assert asked_of(*arena((0.5, 1.4), (4.0, 5.5), shows=(gap,))) == ["parted"]


def test_what_was_said_to_be_one_room_is_not_asked_about_as_a_narrow_place() -> None:
    plan, view = arena((4.0, 5.5))
    said = Override(one_room=source_points_from_plan(plan.frame, [[1.0, 1.0], [6.0, 1.0]]).tolist()).corrections
    joined = preview(plan, said, view.plan, view.spaces, view.standing, walls=view.walls).plan
    narrow = [each for each in questions(joined, (), view) if each.key.startswith("corner")]
    assert narrow
    assert with_effect(joined, narrow, said, view) == []
    asked = questions(joined, (), view, [("one_room", [(1.0, 1.0), (6.0, 1.0)])])
    assert not [each for each in asked if each.key.startswith("corner")]
    outline = shapely.get_coordinates(joined.rooms[0].polygon.exterior)[:-1].tolist()
    asked = questions(joined, (), view, [("room_outline", outline)])
    assert not [each for each in asked if each.key.startswith("corner")]
