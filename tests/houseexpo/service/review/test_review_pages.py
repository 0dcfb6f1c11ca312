"""Review over HTTP: the order, decisions, undo, two people, what is refused."""

from __future__ import annotations

import json
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import msgspec
import pytest

pytest.importorskip("starlette")
from shapely import GEOSException
from starlette.testclient import TestClient

from houseexpo.corrections import apply
from houseexpo.corrections.vocabulary import WORDS
from houseexpo.service.app import make_app
from houseexpo.service.collection import Collection
from houseexpo.service.review.changes import describe_log_line
from houseexpo.service.review.session import Review
from houseexpo.service.review.tools import tools
from houseexpo.service.service import Service, ServiceSettings
from pipeline.overrides import load_overrides
from tests.builders.services import judged_later, no_plans

QUALITIES = {"sure": 0.95, "doubtful": 0.4, "middling": 0.7, "published": None}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return judged_later(tmp_path / "houses", QUALITIES)


@pytest.fixture
def client(folder: Path) -> Iterator[TestClient]:
    with served(folder) as found:
        yield found


def served(folder: Path, **settings: Any) -> TestClient:
    service = Service({"houses": Collection("houses", folder)}, ServiceSettings(**{"review": True, **settings}))
    return TestClient(make_app(service), base_url="http://127.0.0.1")


def state(client: TestClient, **query: str) -> dict[str, Any]:
    answer = client.get("/houses/review/state", params={"reviewer": "ann", **query})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def decide(client: TestClient, plan: str, action: str, status: int = 200, **words: Any) -> dict[str, Any]:
    """Decide on a plan; without ``seen`` after having looked at it."""
    words.setdefault("seen", state(client, plan=plan)["seen"])
    asked = {"plan": plan, "action": action, "reviewer": "ann", **words}
    answer = client.post("/houses/review/decide", json=asked)
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


def overrides(folder: Path) -> dict[str, Any]:
    return tomllib.loads((folder / "overrides.toml").read_text())


def test_the_least_sure_comes_first_and_what_has_no_quality_last(client: TestClient) -> None:
    order = [state(client)["plan"]]
    for _ in range(3):
        order.append(state(client, plan=order[-1], move="next")["plan"])
    assert order == ["doubtful", "middling", "sure", "published"]
    assert state(client, plan="published", move="next")["plan"] == "published"
    assert state(client, plan="middling", move="previous")["plan"] == "doubtful"


def test_what_is_shown_says_why_a_plan_is_doubtful(client: TestClient) -> None:
    found = state(client)
    assert (found["quality"], found["doubtful"], found["place"]) == (0.4, True, 1)
    assert found["grounds"] == [["doors that are cuts, not evidence", 0.5]]
    assert found["progress"] == {"plans": 4, "judged": 0, "doubtful": 2, "doubtful_judged": 0}
    assert [room["label"] for room in found["shape"]["rooms"]] == ["Kitchen", "Bedroom"]
    picture = client.get("/houses/review/pictures/doubtful.svg")
    assert picture.headers["content-type"] == "image/svg+xml"


def test_decisions_are_what_a_build_reads(client: TestClient, folder: Path) -> None:
    decide(client, "doubtful", "door", points=[[0.0, 2.0], [0.0, 2.9]])
    decide(client, "doubtful", "no_room", points=[[7.0, 3.0]])
    decide(client, "doubtful", "note", text="seen\non site")
    decide(client, "sure", "drop", text="a hall")
    decide(client, "middling", "keep")
    found = load_overrides(None, folder / "overrides.toml")
    assert found["doubtful"].door == (((10.0, 0.0), (10.0, 0.9)),)  # metres of the source
    assert found["doubtful"].no_room == ((17.0, 1.0),)
    assert found["doubtful"].why == "seen on site"
    assert found["sure"].drop
    assert found["middling"].keep
    shown = state(client, plan="doubtful")
    assert [(each["word"], each["points"]) for each in shown["effects"]] == [
        ("door", [[0.0, 2.0], [0.0, 2.9]]),
        ("no_room", [[7.0, 3.0]]),
    ]
    assert shown["judged"]["by"] == "ann"
    assert shown["progress"] == {"plans": 4, "judged": 3, "doubtful": 2, "doubtful_judged": 2}


def test_a_note_decides_nothing(client: TestClient) -> None:
    decide(client, "sure", "note", text="looked at")
    assert state(client, plan="sure")["progress"]["judged"] == 0
    decide(client, "sure", "keep")
    assert state(client, plan="sure")["progress"]["judged"] == 1


def test_the_next_open_plan_is_one_that_nobody_judged_or_looks_at(client: TestClient) -> None:
    assert state(client, move="open")["plan"] == "doubtful"
    assert state(client, move="open", reviewer="ben")["plan"] == "middling"
    decide(client, "doubtful", "keep")
    decide(client, "middling", "keep", reviewer="ben")
    assert state(client, move="open", plan="doubtful")["plan"] == "sure"
    decide(client, "sure", "keep")
    decide(client, "published", "drop")
    ended = state(client, move="open", plan="sure")
    assert ended["plan"] is None
    assert sum(ended["summary"]["reviewers"].values()) == ended["progress"]["judged"]
    assert {action: sorted(names) for action, names in ended["summary"]["actions"].items()} == {
        "keep": ["doubtful", "middling", "sure"],
        "drop": ["published"],
    }


def test_a_plan_with_corrections_only_is_open(client: TestClient) -> None:
    decide(client, "published", "drop")
    for name in ("doubtful", "middling", "sure"):
        decide(client, name, "no_room", points=[[7.0, 3.0]])
    found = state(client, move="open")
    assert (found["plan"], found["progress"]["judged"]) == ("doubtful", 4)
    decide(client, "doubtful", "keep")
    assert state(client, move="open")["plan"] == "middling"


def test_undo_goes_back_over_http(client: TestClient, folder: Path) -> None:
    decide(client, "doubtful", "keep")
    found = client.post("/houses/review/undo", json={"reviewer": "ann"}).json()
    assert found["undone"] == found["plan"] == "doubtful"
    assert found["judged"] is None
    assert overrides(folder) == {}
    assert client.post("/houses/review/undo", json={"reviewer": "ann"}).status_code == 400


def test_two_people_do_not_overrule_each_other_unseen(client: TestClient) -> None:
    seen = state(client, plan="doubtful")["seen"]
    decide(client, "doubtful", "keep")
    for name in ("ben", "ann"):  # two people may go by one name
        assert "in the meantime" in decide(client, "doubtful", "drop", 409, reviewer=name, seen=seen)["error"]
    decide(client, "doubtful", "drop", reviewer="ben")


def test_only_the_browsers_of_this_machine_are_offered_its_users_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("getpass.getuser", lambda: "ann")
    for host, name in (("127.0.0.1", "ann"), ("0.0.0.0", "")):  # noqa: S104
        with served(folder, host=host) as client:
            assert f'data-reviewer="{name}"' in client.get("/houses/review").text


HOSTILE: list[tuple[dict[str, Any], int]] = [
    ({"plan": "../../etc/passwd"}, 404),
    ({"plan": "nothing"}, 404),
    ({"action": "delete"}, 400),
    ({"action": "undo"}, 400),
    ({"action": "door"}, 400),
    ({"action": "door", "points": [[1, 1], [1, 1.1]]}, 400),
    ({"action": "door", "points": [[1, 1], [1e9, 1]]}, 400),
    ({"action": "no_room", "points": [[1e308, 1e308]]}, 400),
    ({"action": "door", "points": [[1, 1]] * 50}, 400),
    ({"reviewer": ""}, 400),
    ({"reviewer": "\x00\n"}, 400),
    ({"reviewer": "x" * 61}, 400),
    ({"action": "note", "text": "x" * 501}, 400),
    ({"seen": "no"}, 400),
    ({"why": "unknown key"}, 400),
    ({"plan": "published", "action": "door", "points": [[1, 1], [1, 2]]}, 400),
]


@pytest.mark.parametrize(("words", "status"), HOSTILE)
def test_what_is_no_decision_is_refused_and_nothing_written(
    client: TestClient, folder: Path, words: dict[str, Any], status: int
) -> None:
    asked = {"plan": "doubtful", "action": "keep", "reviewer": "ann", **words}
    answer = client.post("/houses/review/decide", json=asked)
    assert answer.status_code == status
    assert answer.json()["error"]
    assert not (folder / "overrides.toml").exists()
    assert not (folder / "overrides.log.jsonl").exists()


@pytest.mark.parametrize("body", [b"", b"no json", b"[]", b'{"plan":', b"\xff\xfe"])
def test_bodies_that_are_no_json_are_refused(client: TestClient, body: bytes) -> None:
    assert client.post("/houses/review/decide", content=body).status_code == 400


def test_other_sites_decide_nothing(client: TestClient, folder: Path) -> None:
    asked = {"plan": "doubtful", "action": "keep", "reviewer": "ann"}
    for headers in ({"origin": "http://evil.example"}, {"sec-fetch-site": "cross-site"}):
        assert client.post("/houses/review/decide", json=asked, headers=headers).status_code == 403
    assert not (folder / "overrides.toml").exists()


def test_read_only_is_read_only(folder: Path) -> None:
    with served(folder, read_only=True) as client:
        assert client.get("/houses/review").status_code == 200
        assert state(client)["plan"] == "doubtful"
        for path in ("decide", "replace", "undo", "redo", "build", "stop"):
            assert client.post(f"/houses/review/{path}", json={"reviewer": "ann"}).status_code == 403
    assert sorted(file.name for file in folder.iterdir()) == sorted(f"{name}.json" for name in QUALITIES)


def test_without_review_there_are_no_such_pages(folder: Path) -> None:
    with served(folder, review=False) as client:
        assert client.get("/houses/review/state").status_code == 404
        assert client.post("/houses/review/decide", json={}).status_code in {404, 405}


def test_after_a_wall_that_parts_nothing_the_gap_is_asked_about_until_it_is_shut(client: TestClient) -> None:
    def gap(*points: tuple[float, float], status: int = 200, plan: str = "doubtful") -> dict[str, Any]:
        asked = msgspec.json.encode({"plan": plan, "points": points}).decode()
        answer = client.get("/houses/review/gap", params={"asked": asked})
        assert answer.status_code == status, answer.text
        return dict(answer.json())

    wall = [(2.0, 0.1), (2.0, 1.6)]
    asked = {"plan": "doubtful", "action": "wall", "reviewer": "ann"}
    client.post("/houses/review/decide", json={**asked, "points": wall})
    found = gap(*wall)
    assert [each["action"] for each in found["answers"]] == ["wall", "leave"]
    assert "1.4" in found["says"]
    line = found["answers"][0]["points"]
    assert sorted(y for _, y in line) == pytest.approx([1.65, 3.1], abs=0.1)
    parted = client.post("/houses/review/decide", json={**asked, "points": line, "seen": 1}).json()
    assert len(parted["shape"]["rooms"]) == 3
    assert gap(*wall) == gap(*line) == {}
    assert gap((3.0, 2.0)) == {}
    gap((99.0, 2.0), status=400)
    gap(status=400)
    gap((1.0, 1.0), plan="nobody", status=404)


@pytest.mark.parametrize("move", ["here", "open", "next", "previous"])
def test_a_data_set_without_plans_has_an_empty_queue(tmp_path: Path, move: str) -> None:
    with served(no_plans(tmp_path / "none")) as client:
        found = state(client, move=move)
        assert (found["plan"], found["progress"]["plans"]) == (None, 0)
        assert client.get("/houses/review").status_code == 200


def test_requests_at_once_find_one_review(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def slow(collection: Collection) -> Review:
        made.append(collection)
        time.sleep(0.2)
        return Review(collection)

    monkeypatch.setattr("houseexpo.service.review.pages.Review", slow)
    with ThreadPoolExecutor(4) as threads:
        list(threads.map(lambda _: state(client), range(4)))
    assert len(made) == 1


def test_what_was_not_built_cannot_be_built_again(client: TestClient) -> None:
    assert "was not made by houseexpo build" in state(client)["build"]["refusal"]
    assert client.post("/houses/review/build", json={"reviewer": "ann"}).status_code == 400


def test_the_page_shows_its_keys(client: TestClient) -> None:
    page = client.get("/houses/review").text
    for key in ("K", "X", "D", "R", "N", "U", "B", "Space"):
        assert f"<kbd>{key}</kbd>" in page


def test_each_word_of_the_vocabulary_has_a_button_and_a_key_of_its_own(client: TestClient) -> None:
    page = client.get("/houses/review").text
    found = tools()
    assert [tool.word for tool in found] == list(WORDS)
    assert len({tool.key for tool in found} | set("kxnuyb")) == len(WORDS) + 6
    for tool in found:
        assert f'<button id="{tool.word}" type="button" aria-keyshortcuts="{tool.key}"' in page
        assert tool.points >= WORDS[tool.word].depth


def replace(client: TestClient, status: int = 200, **words: Any) -> dict[str, Any]:
    seen = state(client, plan="doubtful")["seen"]
    asked = {"plan": "doubtful", "word": "wall", "reviewer": "ann", "seen": seen, **words}
    answer = client.post("/houses/review/replace", json=asked)
    assert answer.status_code == status, answer.text
    found: dict[str, Any] = answer.json()
    return found


def test_what_is_said_is_moved_taken_out_and_undone_over_http(client: TestClient, folder: Path) -> None:
    (said,) = decide(client, "doubtful", "wall", points=[[2.0, 0.1], [2.0, 3.1]])["effects"]
    found = replace(client, value=said["value"], points=[[3.0, 0.1], [3.0, 3.1]])
    assert "a wall of" in found["effect"]["said"]
    (moved,) = found["effects"]
    assert moved["points"] == [[3.0, 0.1], [3.0, 3.1]]
    assert "nobody says this any more" in replace(client, 409, value=said["value"])["error"]
    assert "no effect" in replace(client, 400, value=moved["value"], points=[[3.0, 4.0], [3.0, 5.0]])["error"]
    assert replace(client, value=moved["value"])["effects"] == []
    assert overrides(folder) == {}
    assert len(client.post("/houses/review/undo", json={"reviewer": "ann"}).json()["effects"]) == 1
    redone = client.post("/houses/review/redo", json={"reviewer": "ann"}).json()
    assert (redone["redone"], redone["effects"]) == ("doubtful", [])
    assert [step["holds"] for step in redone["history"]] == [True, True, True]
    assert client.post("/houses/review/redo", json={"reviewer": "ann"}).status_code == 400


def test_one_decision_may_say_several_words_and_one_undo_takes_them_back(client: TestClient, folder: Path) -> None:
    wall = [[2.0, 0.1], [2.0, 3.1]]
    then = [{"action": "no_room", "points": [[1.0, 1.0]]}, {"action": "no_door", "points": [[90.0, 90.0]]}]
    decide(client, "doubtful", "wall", 400, points=wall, then=then)  # a point far from the plan
    said = decide(client, "doubtful", "wall", points=wall, then=[then[0], then[0]])
    assert [each["word"] for each in said["effects"]] == ["wall", "no_room"]
    assert len(said["shape"]["rooms"]) == 2
    assert len(said["history"]) == 1
    assert "is no room" in said["effect"]["also"][0]
    assert client.post("/houses/review/undo", json={"reviewer": "ann"}).json()["effects"] == []
    assert overrides(folder) == {}


DOOR = [[0.0, 2.0], [0.0, 2.9]]  # in the outer wall of the kitchen, where the plan has none


@pytest.mark.parametrize(
    ("first", "later", "left"),
    [
        (("entrance", DOOR), ("no_door", [[0.0, 2.45]]), set()),  # the plan is as it was
        (("entrance", DOOR), ("window", [[0.0, 2.45]]), {"entrance"}),  # refused: no passage would be there
        (("entrance", DOOR), ("opening", DOOR), {"opening"}),
        (("wall", [[2.0, 0.1], [2.0, 3.1]]), ("one_room", [[1.0, 1.0], [3.0, 1.0]]), {"one_room"}),
        (("no_room", [[7.0, 3.0]]), ("label", [[7.0, 3.0]]), {"label"}),
    ],
)
def test_a_later_word_takes_the_place_of_an_earlier_one_that_it_contradicts(
    client: TestClient, folder: Path, first: tuple[str, Any], later: tuple[str, Any], left: set[str]
) -> None:
    decide(client, "doubtful", first[0], points=first[1])
    before = overrides(folder)
    status = 400 if first[0] in left else 200
    found = decide(client, "doubtful", later[0], status, points=later[1], text="Office" if later[0] == "label" else "")
    assert set(overrides(folder).get("doubtful", {})) == left
    if status == 400:
        assert "no effect" in found["error"]
        return
    title = first[0].replace("_", " ").capitalize()
    assert f"the earlier “{title}” (" in " ".join([found["effect"]["said"], *found["effect"].get("also", ())])
    client.post("/houses/review/undo", json={"reviewer": "ann"})
    assert overrides(folder) == before
    client.post("/houses/review/redo", json={"reviewer": "ann"})
    assert set(overrides(folder).get("doubtful", {})) == left


@pytest.mark.parametrize("words", [{"value": "wall"}, {"value": []}, {"word": "keep", "value": [1, 2]}, {}])
def test_what_does_not_name_a_correction_is_refused(client: TestClient, folder: Path, words: dict[str, Any]) -> None:
    asked = {"plan": "doubtful", "word": "wall", "reviewer": "ann", **words}
    assert client.post("/houses/review/replace", json=asked).status_code in {400, 409}
    assert not (folder / "overrides.toml").exists()


def test_a_correction_that_another_takes_the_effect_of_is_told(client: TestClient) -> None:
    (said,) = decide(client, "doubtful", "wall", points=[[2.0, 0.1], [2.0, 3.1]])["effects"]
    decide(client, "doubtful", "label", points=[[3.0, 1.5]], text="Hall")
    done = replace(client, value=said["value"], points=[[3.0, 0.1], [3.0, 3.1]])
    assert "but the earlier “Label” (L) has no effect any more: no room is there" in " ".join(done["effect"]["also"])
    assert [each["outcome"] for each in done["effects"]] == ["done", "none"]


@pytest.mark.parametrize("step", ["settle", "_try_again", "_apply_waiting", "_WORDS"])
def test_a_word_whose_shapes_cannot_be_computed_is_refused_and_nothing_written(
    client: TestClient, folder: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    decide(client, "doubtful", "label", points=[[1.0, 1.0]], text="Hall")
    before = overrides(folder)

    def fault(*_: Any) -> None:
        raise GEOSException("TopologyException: side location conflict")

    monkeypatch.setattr(apply, step, {**apply._WORDS, "no_room": fault} if step == "_WORDS" else fault)
    refused = decide(client, "doubtful", "no_room", 400, points=[[1.0, 1.0]])
    assert "no_room: no effect: its shapes cannot be computed (TopologyException: side" in refused["error"]
    assert overrides(folder) == before
    assert len(state(client, plan="doubtful")["shape"]["doors"]) == 1


def test_the_same_of_several_places_is_one_decision_and_one_undo(client: TestClient, folder: Path) -> None:
    shape = state(client, plan="doubtful")["shape"]
    (x1, y1, x2, y2) = shape["bounds"]
    places = [[round(x1 + 1.0, 2), round(y1 + 1.0, 2)], [round(x2 - 1.0, 2), round(y1 + 1.0, 2)]]
    beside = [round(x2 + 1.5, 2), round(y2 + 1.5, 2)]  # in no room: it has no effect
    done = decide(client, "doubtful", "label", points=[places[0]], more=[[places[1]], [beside]], text="Office")
    assert "2 places at once" in done["effect"]["said"]
    assert "at 1 it has none" in done["effect"]["also"][0]
    assert [room["label"] for room in done["shape"]["rooms"]] == ["Office", "Office"]
    assert len(overrides(folder)["doubtful"]["label"]) == 2
    client.post("/houses/review/undo", json={"reviewer": "ann"})
    assert overrides(folder) == {}


def test_several_questions_are_left_at_once(client: TestClient, folder: Path) -> None:
    decide(client, "doubtful", "leave", text="cut at 1.0, 2.0\nroom at 3.0, 4.0")
    review = Review(Collection("houses", folder))
    assert set(review.decisions.left("doubtful")) == {"cut at 1.0, 2.0", "room at 3.0, 4.0"}


def test_an_answer_that_confirms_the_plan_is_logged_as_what_it_says(client: TestClient, folder: Path) -> None:
    found = decide(client, "doubtful", "leave", text="meet at 1.0, 2.0", answer="Two rooms")
    assert found["history"][-1]["answer"] == "Two rooms"
    decisions = Review(Collection("houses", folder)).decisions
    assert set(decisions.left("doubtful")) == {"meet at 1.0, 2.0"}
    assert describe_log_line(decisions.latest()["doubtful"]) == "ann answered “Two rooms”"
    client.post("/houses/review/undo", json={"reviewer": "ann"})
    client.post("/houses/review/redo", json={"reviewer": "ann"})
    assert state(client, plan="doubtful")["history"][-1]["answer"] == "Two rooms"
    assert decide(client, "doubtful", "leave", text="room at 3.0, 4.0")["history"][-1]["answer"] == ""


def test_what_was_said_of_another_state_of_the_file_is_a_ghost_until_somebody_answers(folder: Path) -> None:
    def made_of(source: str) -> None:
        for file in folder.glob("**/doubtful.json"):
            plan = json.loads(file.read_text())
            plan["provenance"] = {**(plan.get("provenance") or {}), "sha256": source}
            file.write_text(json.dumps(plan))

    made_of("a" * 64)
    with served(folder) as client:
        (x1, y1, _, _) = state(client, plan="doubtful")["shape"]["bounds"]
        decide(client, "doubtful", "label", points=[[x1 + 1.0, y1 + 1.0]], text="Office")
        assert not state(client, plan="doubtful")["effects"][0]["ghost"]
    made_of("b" * 64)
    with served(folder) as client:
        found = state(client, plan="doubtful")
        assert found["effects"][0]["ghost"]
        asked = found["questions"][0]
        assert "The file has changed since 1 correction was made here" in asked["says"]
        decide(client, "doubtful", "leave", text=asked["key"])
        found = state(client, plan="doubtful")
        assert not any(each.get("ghost") for each in found["effects"])
        assert not any(each["key"].startswith("changed") for each in found["questions"])


def test_what_was_said_before_the_size_of_the_file_is_a_ghost_until_somebody_answers(folder: Path) -> None:
    said = Review(Collection("houses", folder)).decisions
    with served(folder) as client:
        (x1, y1, _, _) = state(client, plan="doubtful")["shape"]["bounds"]
        decide(client, "doubtful", "label", points=[[x1 + 1.0, y1 + 1.0]], text="Office")
        said.say_of_file("doubtful", "floors", [0.0], "ann")
        assert not state(client, plan="doubtful")["effects"][0]["ghost"]
        said.say_of_file("doubtful", "scale", 2.0, "ann")
        decide(client, "doubtful", "door", points=[[x1, y1 + 1.0], [x1, y1 + 1.9]])
        found = state(client, plan="doubtful")
        assert {each["word"]: each["ghost"] for each in found["effects"]} == {"label": True, "door": False}
        asked = found["questions"][0]
        assert "The size or the axis of the file was said since 1 correction was made here" in asked["says"]
        decide(client, "doubtful", "leave", text=asked["key"])
        assert not any(each.get("ghost") for each in state(client, plan="doubtful")["effects"])
        said.say_of_file("doubtful", "scale", 3.0, "ann")
        found = state(client, plan="doubtful")
        assert {each["word"]: (each["ghost"], each["grown"]) for each in found["effects"]} == {
            "label": (True, 3.0),
            "door": (True, 1.5),
        }
        assert "grow" in [each["action"] for each in found["questions"][0]["answers"]]
        (old,) = (each["value"] for each in found["effects"] if each["word"] == "label")
        said.say_of_file("doubtful", "scale", 1.0001, "ann")
        replace(client, word="label", value=old, by=1.0001)
        (now,) = (each for each in state(client, plan="doubtful")["effects"] if each["word"] == "label")
        assert (now["ghost"], now["value"]) == (False, [round(old[0] * 1.0001, 3), round(old[1] * 1.0001, 3), old[2]])
        said.say_of_file("doubtful", "units", "cm", "ann")
        assert "grow" not in [each["action"] for each in state(client, plan="doubtful")["questions"][0]["answers"]]


def test_one_room_joins_the_rooms_that_the_page_shows_and_no_others(client: TestClient) -> None:
    parted = decide(client, "doubtful", "opening", points=[(0.2, 1.5), (6.0, 1.5)])
    assert len(parted["shape"]["rooms"]) == 3
    upper, lower, right = sorted(parted["shape"]["rooms"], key=lambda room: room["label"] == "Bedroom")
    joined = decide(client, "doubtful", "one_room", points=[(2.0, 0.6), (8.0, 1.0)])
    areas = sorted(room["area"] for room in joined["shape"]["rooms"])
    assert areas[0] in {upper["area"], lower["area"]}
    assert len(areas) == 2
    assert areas[1] > right["area"] + 1.0
    assert {each["outcome"] for each in joined["effects"]} == {"done"}
