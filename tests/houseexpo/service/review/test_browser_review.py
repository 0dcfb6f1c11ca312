"""Review as a person does it: with the keyboard alone, and with clicks."""

from __future__ import annotations

import base64
import io
import math
import re
import time
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image

pytest.importorskip("starlette")

from houseexpo import build, open_dataset, save_plan
from houseexpo.plan import Door
from tests.builders.browsing import look, visited
from tests.builders.services import FRAME, box, judged_later, no_plans, running, service_of, two_rooms

pytestmark = [pytest.mark.slow, pytest.mark.browser]
PHONE: dict[str, Any] = {"viewport": {"width": 390, "height": 800}, "color_scheme": "dark", "has_touch": True}
QUALITIES = {"doubtful": 0.4, "middling": 0.7, "sure": 0.95}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return judged_later(tmp_path / "houses", QUALITIES)


@pytest.fixture
def page(folder: Path) -> Iterator[Any]:
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as found:
        shows(found, "doubtful")
        yield found


def shows(page: Any, plan: str) -> None:
    page.wait_for_function("name => document.getElementById('plan').textContent === name", arg=plan)
    page.wait_for_selector("#plan-drawing")


def says(page: Any, words: str) -> None:
    page.wait_for_function("words => document.getElementById('said').textContent.includes(words)", arg=words)


def overrides(folder: Path) -> dict[str, Any]:
    return tomllib.loads((folder / "overrides.toml").read_text())


def two_doubtful_rooms(place: Path) -> Path:
    """A data set of one plan, both of whose rooms are asked about."""
    folder = place / "houses"
    folder.mkdir()
    plan = replace(two_rooms("house"), frame=FRAME)
    save_plan(replace(plan, rooms=tuple(replace(room, confidence=0.4) for room in plan.rooms)), folder / "house.json")
    return folder


def test_the_keyboard_alone_is_enough(page: Any, folder: Path) -> None:
    press = page.keyboard.press
    press("d")
    press("Shift+ArrowRight")
    press("Shift+ArrowUp")
    for _ in range(4):
        press("ArrowUp")
    press("Enter")
    for _ in range(9):
        press("ArrowDown")
    look(page, "review-door")
    press("Enter")
    says(page, "In the next build of doubtful: a door of 0.90 m joins")
    assert "door, in the next build: a door of 0.90 m joins" in page.inner_text("#effects")
    ((x1, y1), (x2, y2)) = overrides(folder)["doubtful"]["door"]
    assert (x2 - x1, y2 - y1) == pytest.approx((0.0, -0.9), abs=0.001)
    press("r")
    press("Shift+ArrowLeft")
    press("Enter")
    says(page, "is no room")
    press("n")
    page.keyboard.type("seen on site")
    press("Enter")
    says(page, "Note saved for doubtful")
    look(page, "review-marks")
    press("u")
    says(page, "Undone")
    assert "why" not in overrides(folder)["doubtful"]
    press("k")
    shows(page, "middling")
    press("x")
    shows(page, "sure")
    assert overrides(folder)["doubtful"]["keep"]
    assert overrides(folder)["middling"] == {"drop": True}
    assert "2 of 2 doubtful plans have decisions" in page.inner_text("#progress-words")
    press("u")
    says(page, "nothing to undo on this plan. U again takes back the last decision on middling")
    press("u")
    shows(page, "middling")
    assert "middling" not in overrides(folder)
    press("ArrowLeft")
    shows(page, "doubtful")
    press("ArrowRight")
    shows(page, "middling")
    press("k")
    shows(page, "sure")
    press("k")
    says(page, "All plans are reviewed")
    ended = page.inner_text("#ended")
    assert "All 3 plans are reviewed" in ended
    assert "3 plans: kept" in ended
    assert "Decided by" in ended
    look(page, "review-ended")


def test_the_page_opens_on_a_plan_also_if_all_are_reviewed(folder: Path) -> None:
    with running(service_of(folder, review=True)) as address, visited(address, "/houses") as page:
        for name in QUALITIES:
            asked = {"plan": name, "action": "keep", "reviewer": "ann"}
            assert page.request.post("/houses/review/decide", data=asked).ok
        page.goto(f"{address}/houses/review")
        says(page, "All plans are reviewed")
        shows(page, "doubtful")
        assert page.is_visible("#ended")
        assert page.inner_text("#progress-words") == "2 of 2 doubtful plans have decisions, 3 of all 3"


def pixel(page: Any, x: float, y: float) -> tuple[float, float]:
    """Where a point of the plan lies in the window."""
    script = """([x, y]) => {
      const place = new DOMPoint(x, -y).matrixTransform(document.getElementById("plan-drawing").getScreenCTM());
      return [place.x, place.y];
    }"""
    found: tuple[float, float] = tuple(page.evaluate(script, [x, y]))
    return found


def click(page: Any, *points: tuple[float, float]) -> None:
    for point in points:
        page.mouse.click(*pixel(page, *point))


def test_a_door_is_two_clicks_where_it_is_seen(page: Any, folder: Path) -> None:
    page.click("#door")
    click(page, (0.1, 2.02), (0.09, 1.03))
    says(page, "In the next build of doubtful: an entrance of")
    ((x1, y1), (x2, y2)) = overrides(folder)["doubtful"]["door"]
    assert (x1, x2) == pytest.approx((10.1, 10.1))  # on the edge
    assert (y1, y2) == pytest.approx((0.02, -0.97), abs=0.03)
    assert page.locator(".changed .is").count() == 1  # the new entrance, in colour
    look(page, "review-changed")


def test_points_snap_to_ends_and_alt_leaves_them_where_they_are(page: Any, folder: Path) -> None:
    page.keyboard.press("w")
    click(page, (2.0, 3.05))  # the edge of the room at y = 3.1
    page.mouse.move(*pixel(page, 2.05, 0.13))
    page.wait_for_function("() => document.getElementById('hint').textContent.includes('at edge, right angle')")
    assert "[12.00, -1.90] in the source" in page.inner_text("#hint")  # as overrides.toml has it
    click(page, (2.05, 0.13))
    says(page, "a wall of")
    assert overrides(folder)["doubtful"]["wall"] == [
        pytest.approx([12.0, 1.1], abs=0.02),
        pytest.approx([12.0, -1.9], abs=0.02),
    ]
    page.keyboard.press("w")
    page.keyboard.down("Alt")
    click(page, (3.5, 3.05), (3.55, 0.15))
    page.keyboard.up("Alt")
    page.wait_for_function("() => document.querySelectorAll('#effects li').length === 2")
    (_, ((x1, y1), (x2, y2))) = overrides(folder)["doubtful"]["wall"]
    assert (x1, y1, x2, y2) == pytest.approx((13.5, 1.05, 13.55, -1.85), abs=0.02)
    for _ in range(10):
        page.keyboard.press("-")  # a pixel is some 0.1 m
    page.keyboard.press("d")
    page.mouse.move(*pixel(page, 2.0, 3.6))
    assert "at edge" not in page.inner_text("#hint")
    page.mouse.move(*pixel(page, 2.0, 3.15))
    page.wait_for_function("() => document.getElementById('hint').textContent.includes('at ')")


def test_what_is_said_is_chosen_moved_taken_out_undone_and_made_again(page: Any, folder: Path) -> None:
    page.keyboard.press("w")
    click(page, (2.0, 3.1), (2.0, 0.1))
    says(page, "a wall of")
    click(page, (2.0, 1.5))
    page.wait_for_selector("#effects li.chosen")
    look(page, "review-chosen")
    page.mouse.move(*pixel(page, 2.0, 0.1))
    page.mouse.down()
    page.mouse.move(*pixel(page, 2.6, 0.12), steps=4)
    page.mouse.up()
    says(page, "In the next build of doubtful: a wall of")
    page.wait_for_function("() => document.getElementById('table').textContent.includes('12.6')")
    moved = overrides(folder)["doubtful"]["wall"]
    assert moved == [pytest.approx([12.0, 1.1], abs=0.02), pytest.approx([12.6, -1.9], abs=0.03)]
    click(page, (2.3, 1.6))
    page.wait_for_selector("#effects li.chosen")
    page.keyboard.press("Delete")
    says(page, "Taken out: wall")
    assert "doubtful" not in overrides(folder)
    for key in ("u", "Control+z"):
        page.keyboard.press(key)
    page.wait_for_function("() => document.querySelectorAll('#history .undone').length === 2")
    assert overrides(folder)["doubtful"]["wall"][1] == pytest.approx([12.0, -1.9], abs=0.02)
    page.keyboard.press("y")
    page.wait_for_function("() => document.querySelectorAll('#history .undone').length === 1")
    assert overrides(folder)["doubtful"]["wall"] == moved
    page.keyboard.press("Control+Shift+z")
    page.wait_for_function("() => document.querySelectorAll('#history .undone').length === 0")
    assert page.locator("#history li").all_inner_texts()[0].startswith("Wall (")
    assert "doubtful" not in overrides(folder)


def test_no_click_is_lost_while_an_answer_is_on_its_way(page: Any, folder: Path) -> None:
    page.route("**/review/decide", lambda route: (time.sleep(0.4), route.continue_()))
    for x in (1.3, 2.6, 3.9):
        page.keyboard.press("w")
        click(page, (x, 3.1), (x, 0.1))
    page.wait_for_function("() => document.querySelectorAll('#effects li').length === 3")
    assert [wall[0][0] for wall in overrides(folder)["doubtful"]["wall"]] == pytest.approx([11.3, 12.6, 13.9], abs=0.03)


def test_an_outline_ends_at_its_first_point_or_by_its_key(page: Any) -> None:
    page.keyboard.press("o")
    click(page, (1.0, 2.0), (7.0, 2.0))
    assert page.locator("#effects li").count() == 0
    page.keyboard.press("o")
    says(page, "one room")
    page.wait_for_function("() => document.querySelectorAll('#effects li').length === 1")


def test_an_edge_of_a_room_is_dragged_and_a_click_on_it_is_a_corner(page: Any, folder: Path) -> None:
    page.keyboard.press("m")
    page.mouse.move(*pixel(page, 2.0, 3.1))
    page.mouse.down()
    page.mouse.move(*pixel(page, 2.2, 4.1), steps=4)
    look(page, "review-edge-dragged")
    page.mouse.up()
    says(page, "a room of 20")
    outline = overrides(folder)["doubtful"]["room_outline"]
    assert len(outline) == 4
    assert max(y for _, y in outline) == pytest.approx(2.1, abs=0.05)
    page.keyboard.press("u")
    says(page, "Undone")
    page.keyboard.press("m")
    click(page, (0.1, 0.1), (2.0, 0.1), (2.0, 3.1), (0.1, 3.1))
    page.keyboard.press("m")
    says(page, "a room of 5.7 m2 is there")


def test_a_plan_is_drawn_on_with_a_finger(folder: Path) -> None:
    with (
        running(service_of(folder, review=True)) as address,
        visited(address, "/houses/review?plan=middling", **PHONE) as page,
    ):
        shows(page, "middling")
        page.tap("#wall")
        page.locator("#stage").scroll_into_view_if_needed()
        for point in ((2.0, 3.0), (2.1, 0.2)):
            page.touchscreen.tap(*pixel(page, *point))
        says(page, "a wall of")
        page.touchscreen.tap(*pixel(page, 2.0, 1.5))
        page.wait_for_selector("#effects li.chosen")
        page.tap("#effects .out")
        says(page, "Taken out: wall")
    assert overrides(folder) == {}


def test_it_asks_first_and_a_key_answers(tmp_path: Path) -> None:
    folder = tmp_path / "houses"
    folder.mkdir()
    plan = replace(two_rooms("home_L0"), frame=FRAME)
    cut, unsure = replace(plan.doors[0], kind="cut", confidence=0.06), replace(plan.rooms[1], confidence=0.6)
    save_plan(replace(plan, doors=(cut,), rooms=(plan.rooms[0], unsure)), folder / "home_L0.json")
    save_plan(replace(plan, id="home_L1"), folder / "home_L1.json")
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "home_L0")
        asks = "words => document.getElementById('question').textContent.includes(words)"
        page.wait_for_function(asks, arg="so a cut of 0.80 m was made. Is a door there?")
        assert page.locator("#kinds button").all_inner_texts() == ["1 cut", "1 room"]
        look(page, "review-question")
        page.keyboard.press("1")
        says(page, "the cut there is a door now")
        page.wait_for_function(asks, arg="Is this bedroom of 9.0 m² a room of the house?")
        page.keyboard.press("5")  # no answer: this question has four
        assert page.locator("#answers button").all_inner_texts()[-1].split() == ["9", "Leave", "it"]
        page.keyboard.press("9")
        says(page, "Left a question about home_L0")
        assert page.locator("#asked").is_hidden()
        page.reload()
        shows(page, "home_L0")
        assert page.locator("#asked").is_hidden()  # it is remembered
        page.keyboard.press("u")
        page.wait_for_function(asks, arg="Is this bedroom")
        page.keyboard.press("2")
        says(page, "no room")
        page.get_by_role("button", name="L1", exact=True).click()
        shows(page, "home_L1")
        look(page, "review-storeys")
    assert list(overrides(folder)["home_L0"]) == ["door", "no_room"]


def test_an_answer_that_confirms_the_plan_is_said_as_it_is(tmp_path: Path) -> None:
    folder = tmp_path / "houses"
    folder.mkdir()
    plan = replace(two_rooms("house"), frame=FRAME, doors=())
    kitchen, bedroom = plan.rooms
    wide = replace(kitchen, ring=box(0.1, 0.1, 4.2, 3.1))  # to the bedroom
    save_plan(replace(plan, rooms=(wide, bedroom)), folder / "house.json")
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.wait_for_function("() => document.getElementById('question').textContent.includes('Are they one room?')")
        page.keyboard.press("2")
        says(page, "Right: two rooms, in house. It is on the disk.")
        assert page.locator("#history li").all_inner_texts()[0].startswith("Right: two rooms (")


@pytest.mark.parametrize("stays", [True, False])
@pytest.mark.parametrize("kind", ["space", "guess"])
def test_the_question_on_the_screen_stays_when_the_source_arrives(tmp_path: Path, kind: str, stays: bool) -> None:
    folder = tmp_path / "houses"
    folder.mkdir()
    plan = replace(two_rooms("house"), frame=FRAME)
    kitchen, bedroom = plan.rooms
    save_plan(replace(plan, rooms=(kitchen, replace(bedroom, confidence=0.6))), folder / "house.json")
    told = {"known": False, "why": "", "changed": ""}
    other = {
        "key": f"{kind} at 9.0, 2.0", "at": [5.0, 2.0], "says": "Is this space a room?", "doubt": 0.9, "area": 9.0,
        "answers": [{"title": "A room", "action": "room", "points": [[5.0, 2.0]]}, {"title": "No", "action": "leave"}],
    }  # fmt: skip

    def state(route: Any) -> None:
        """Answer that a source is being read, and that another question is asked when it has been."""
        found = route.fetch().json()
        asked = [other, *(found["questions"] if stays else [])] if told["known"] else found["questions"]
        route.fulfill(json={**found, "questions": asked, "source": {**found["source"], **told}})

    def source(route: Any) -> None:
        time.sleep(0.3)
        told["known"] = True
        route.fulfill(json={"layers": [], "edges": [], "places": [], "strokes": []})

    with running(service_of(folder, review=True)) as address, visited(address, "/houses") as page:
        page.route(re.compile("/review/state"), state)
        page.route(re.compile("/review/source"), source)
        page.goto(f"{address}/houses/review")
        shows(page, "house")
        asks = "words => document.getElementById('question').textContent.includes(words)"
        page.wait_for_function(asks, arg="Is this bedroom")
        page.wait_for_function("() => document.querySelectorAll('#kinds button').length === 2")  # the source is there
        assert "Is this bedroom" in page.inner_text("#question")
        page.keyboard.press("2")
        says(page, "no room")
        assert list(overrides(folder)["house"]) == ["no_room"]


def test_a_key_for_a_question_that_is_gone_does_not_answer_the_one_that_came(tmp_path: Path) -> None:
    folder = two_doubtful_rooms(tmp_path)
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.wait_for_selector("#all:not([hidden])")
        first = page.inner_text("#question")
        asked = {"plan": "house", "action": "no_room", "points": [[2.0, 2.0]], "reviewer": "ben"}
        assert page.request.post("/houses/review/decide", data=asked).ok
        page.evaluate(
            """async (first) => {  // the key is pressed as soon as the other question is there
              const place = document.getElementById("question");
              new MutationObserver(() => {
                const key = new KeyboardEvent("keydown", { key: "2", bubbles: true });
                if (place.textContent !== first) document.body.dispatchEvent(key);
              }).observe(place, { childList: true });
            }""",
            first,
        )
        page.keyboard.press("ArrowLeft")  # the same plan again, as ben left it
        says(page, "The last key was not taken: another question has come in the meantime.")
        assert list(overrides(folder)["house"]) == ["no_room"]
        page.wait_for_timeout(600)
        page.keyboard.press("1")
        page.wait_for_function("() => document.querySelectorAll('#history li').length === 2")


def test_a_source_that_cannot_be_read_is_read_again_on_demand(folder: Path) -> None:
    # the browser has a line of its own about the request that fails
    with running(service_of(folder, review=True)) as address, pytest.raises(AssertionError, match="422"):
        _read_again(address)


def _read_again(address: str) -> None:
    told = {"known": False, "why": "", "can_be_read": True, "said": {}}
    times: list[float] = []

    def state(route: Any) -> None:
        found = route.fetch().json()
        route.fulfill(json={**found, "source": {**found["source"], **told}})

    def source(route: Any) -> None:
        times.append(time.monotonic())
        if len(times) == 1:
            time.sleep(2.5)
            told["why"] = "out of breath"
            route.fulfill(status=422, json={"error": "out of breath"})
            return
        told.update(known=True, why="")
        route.fulfill(json={"layers": [], "edges": [], "places": [], "strokes": []})

    with visited(address, "/houses") as page:
        page.route(re.compile("/review/state"), state)
        page.route(re.compile("/review/source"), source)
        page.goto(f"{address}/houses/review?plan=doubtful", wait_until="commit")
        page.wait_for_function(
            "() => / source of this plan.* [12] s/.test(document.getElementById('doing')?.innerText)"
        )
        look(page, "review-reading")
        says(page, "out of breath")
        page.keyboard.press("ArrowRight")
        shows(page, "middling")
        page.keyboard.press("ArrowLeft")
        shows(page, "doubtful")
        assert "The source could not be read." in page.inner_text("#doing")
        page.click("#again")
        page.wait_for_function("() => document.getElementById('doing').hidden")
        assert len(times) == 2


def test_a_click_on_a_marked_place_asks_about_it_alone(tmp_path: Path) -> None:
    folder = two_doubtful_rooms(tmp_path)
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.wait_for_selector("#all:not([hidden])")
        first = page.inner_text("#question")
        page.keyboard.press("Shift+0")
        places = page.locator(".like-at").all()
        assert len(places) == 2
        x, y = (float(places[1].get_attribute(name) or "") for name in ("cx", "cy"))
        click(page, (x, -y))
        page.wait_for_function("first => document.getElementById('question').textContent !== first", arg=first)
        assert page.locator(".like-at").count() == 0
        page.keyboard.press("1")
        page.wait_for_function("() => document.querySelectorAll('#history li').length === 1")
        assert overrides(folder)["house"]["room"] == pytest.approx([10 + x, -2 - y], abs=0.01)
        page.wait_for_function("first => document.getElementById('question').textContent === first", arg=first)


def test_an_undo_asks_again_what_was_answered(tmp_path: Path) -> None:
    folder = two_doubtful_rooms(tmp_path)
    is_first = "([first, same]) => (document.getElementById('question').textContent === first) === same"
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.wait_for_selector("#all:not([hidden])")
        first = page.inner_text("#question")
        for key in ("1", "9"):
            page.keyboard.press(key)
            page.wait_for_function(is_first, arg=[first, False])
            page.keyboard.press("u")
            page.wait_for_function(is_first, arg=[first, True])


def test_what_is_alike_stays_so_while_it_is_answered(tmp_path: Path) -> None:
    folder = tmp_path / "houses"
    folder.mkdir()
    plan = replace(two_rooms("house"), frame=FRAME)
    ways = [((0.05, 0.2), (0.05, 1.1), 0), *(((7.25, y), (7.25, y + w), 1) for y, w in ((0.2, 1.6), (1.5, 2.2)))]
    ways.insert(1, ((1.0, 0.05), (2.9, 0.05), 0))  # of 1.9 m, and the first to be asked about
    doors = [
        Door(
            k,
            "entrance",
            (a, b),
            round(math.dist(a, b), 2),
            shapely.get_coordinates(line.buffer(0.05))[:-1],
            (room, None),
            0.5,
        )
        for k, (a, b, room) in enumerate(ways, 1)
        for line in [shapely.LineString([a, b])]
    ]
    save_plan(replace(plan, doors=(*plan.doors, *doors)), folder / "house.json")
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.wait_for_selector("#kinds:not([hidden])")
        assert "3 entrances: 1.6 to 2.2 m" in page.inner_text("#kinds")
        page.click("text=3 entrances")
        assert "1.90 m" in page.inner_text("#question")
        page.keyboard.press("1")
        page.wait_for_selector("text=2 entrances: 1.6 to 2.2 m")


def test_shift_marks_what_is_alike_and_once_more_answers_it(tmp_path: Path) -> None:
    folder = tmp_path / "houses"
    folder.mkdir()
    plan = replace(two_rooms("house"), frame=FRAME)
    unsure = tuple(replace(room, confidence=0.4) for room in plan.rooms)
    save_plan(replace(plan, rooms=unsure), folder / "house.json")
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.wait_for_selector("#all:not([hidden])")
        assert "All 2 like this" in page.inner_text("#all")
        page.keyboard.press("Shift+1")
        says(page, "2 places are marked")
        assert page.locator(".like-at").count() == 2
        look(page, "review-all-alike")
        page.keyboard.press("Escape")
        assert page.locator(".like-at").count() == 0
        assert not (folder / "overrides.toml").exists()
        page.keyboard.press("Shift+9")
        says(page, "Shift-9 again, or Enter, says “Leave it” of all of them")
        page.keyboard.press("Escape")
        page.keyboard.press("Shift+1")
        page.keyboard.press("Shift+1")
        says(page, "2 places at once, which one undo takes back")
        assert len(overrides(folder)["house"]["room"]) == 2
        page.keyboard.press("u")
        says(page, "Undone")
        assert overrides(folder) == {}
        page.click("#all")
        assert page.locator(".like-at").count() == 2
        page.keyboard.press("Shift+0")
        says(page, "No places are marked: the next answer counts for this one")
        assert page.locator(".like-at").count() == 0
        page.keyboard.press("Shift+0")
        says(page, "2 places are marked")
        page.click("#answers button >> nth=0")
        says(page, "2 places at once")


def test_while_an_answer_is_worked_on_the_page_says_so_and_takes_no_other(tmp_path: Path) -> None:
    folder = two_doubtful_rooms(tmp_path)
    held: list[Any] = []
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.route(re.compile("/review/decide"), lambda route: held.extend([route]))
        page.wait_for_selector("#all:not([hidden])")
        page.keyboard.press("Shift+1")
        page.keyboard.press("Shift+1")
        page.wait_for_selector("#doing")
        page.keyboard.press("2")
        says(page, "The last key was not taken")
        page.keyboard.press("Shift+0")
        assert page.inner_text("#doing") == "Working on the last decision…"  # whatever else is said
        page.keyboard.press("u")  # waits its turn
        (route,) = held
        route.continue_()
        says(page, "Undone")
    assert overrides(folder) == {}


def test_rooms_of_other_sizes_are_marked_only_as_all_of_the_kind(tmp_path: Path) -> None:
    folder = tmp_path / "houses"
    folder.mkdir()
    plan = replace(two_rooms("house", 8.0), frame=FRAME)
    save_plan(replace(plan, rooms=tuple(replace(room, confidence=0.4) for room in plan.rooms)), folder / "house.json")
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.wait_for_selector("#all:not([hidden])")
        assert page.locator("#kinds button").all_inner_texts() == ["1 room: 24.0 m²", "1 room: 9.0 m²"]
        page.keyboard.press("Shift+0")
        says(page, "2 places are marked")
        page.keyboard.press("1")
        says(page, "2 places at once")
        assert len(overrides(folder)["house"]["room"]) == 2


def test_a_click_on_a_line_of_a_drawing_makes_walls_of_its_layer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    drawing = ezdxf.new("R2010", units=6)
    for x1, y1, x2, y2 in ((0.0, 0.0, 9.0, 5.0), (0.2, 0.2, 8.8, 4.8)):
        ring = [(x1, y1), (x2, y1), (x2, y2), (x1, y2)]
        drawing.modelspace().add_lwpolyline(ring, close=True, dxfattribs={"layer": "WALL"})
    for x in (3.0, 6.0):
        drawing.modelspace().add_line((x, 0.2), (x, 4.8), dxfattribs={"layer": "NEW"})
    drawing.saveas(tmp_path / "plan.dxf")
    build(tmp_path / "plan.dxf", tmp_path / "houses", workers=1)
    (name,) = open_dataset(tmp_path / "houses").ids
    with running(service_of(tmp_path / "houses", review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, name)
        page.get_by_role("button", name=re.compile("Lines of the file")).click(timeout=60_000)
        page.wait_for_selector(".strokes .stroke", state="attached")
        x1, y1 = page.evaluate(
            """() => {
              const all = [...document.querySelectorAll(".strokes .stroke")];
              const [, first] = all.find((each) => each.textContent.startsWith("NEW")).getAttribute("d").split("M");
              const [from, to] = first.split("L").map((each) => each.split(",").map(Number));
              return [from[0], -(from[1] * 0.3 + to[1] * 0.7)];
            }"""
        )
        page.select_option("#file-key", "drop_nodes")  # a click marks the layer of a line
        click(page, (x1, y1))
        assert page.locator("#file-names option:checked").all_inner_texts() == ["NEW"]
        assert page.locator(".marks .named.line").count() == 2
        page.select_option("#file-key", "units")
        click(page, (x1, y1))
        page.wait_for_function("() => document.getElementById('question').textContent.includes('“NEW” in the drawing')")
        assert "All 2 like this" in page.inner_text("#all")
        page.click("#all")
        look(page, "review-strokes")
        page.keyboard.press("1")
        says(page, "2 places at once")
        assert len(overrides(tmp_path / "houses")[name]["wall"]) == 2
        page.wait_for_function("() => document.getElementById('title').textContent.startsWith('3 rooms')")


def test_of_very_many_lines_the_nearest_are_marked_and_counted(folder: Path) -> None:
    lines = [
        {"kind": "NEW", "points": [[round(0.3 + 0.02 * k, 2), 0.5], [round(0.3 + 0.02 * k, 2), 2.5]]}
        for k in range(240)
    ]
    told: dict[str, Any] = {}

    def state(route: Any) -> None:
        found = route.fetch().json()
        told["state"] = {**found, "questions": [], "source": {**found["source"], "known": True, "why": ""}}
        route.fulfill(json=told["state"])

    def decide(route: Any) -> None:
        told["asked"] = route.request.post_data_json
        route.fulfill(json=told["state"])

    with running(service_of(folder, review=True)) as address, visited(address, "/houses") as page:
        page.route(re.compile("/review/state"), state)
        page.route(re.compile("/review/decide"), decide)
        drawn = {"layers": [], "edges": [], "places": [], "strokes": lines}
        page.route(re.compile("/review/source"), lambda route: route.fulfill(json=drawn))
        page.goto(f"{address}/houses/review?plan=doubtful")
        shows(page, "doubtful")
        page.get_by_role("button", name=re.compile("Lines of the file")).wait_for()
        if not page.locator(".strokes .stroke").count():
            page.get_by_role("button", name=re.compile("Lines of the file")).click()
        page.wait_for_selector(".strokes .stroke", state="attached")
        click(page, (4.9, 1.5))
        page.wait_for_function("() => document.getElementById('all').textContent.includes('The nearest 200 of 240')")
        page.click("#all")
        says(page, "The nearest 200 of 240 lines are marked: the next answer counts for all of them")
        look(page, "review-nearest")
        page.keyboard.press("1")
        page.wait_for_function("() => document.getElementById('asked').hidden")
    ends = [told["asked"]["points"], *told["asked"]["more"]]
    assert len(ends) == 200
    assert min(x for (x, _), _ in ends) > 1.0  # the first 40 lines are further away


def test_escape_and_another_persons_decision(folder: Path) -> None:
    # the browser has a line of its own about the request that is refused
    with running(service_of(folder, review=True)) as address, pytest.raises(AssertionError, match="409"):
        _decide_after_ben(address)
    assert overrides(folder)["doubtful"] == {"drop": True}


def _decide_after_ben(address: str) -> None:
    with visited(address, "/houses/review") as page:
        shows(page, "doubtful")
        for key in ("d", "Escape", "n", "Escape"):
            page.keyboard.press(key)
        asked = {"plan": "doubtful", "action": "drop", "reviewer": "ben"}
        assert page.request.post("/houses/review/decide", data=asked).ok
        page.keyboard.press("k")
        says(page, "ben chose drop in the meantime")
        assert page.inner_text("#judged") == "ben: dropped"  # what there is now to look at


def test_without_plans_it_says_that_there_is_nothing_to_judge(tmp_path: Path) -> None:
    service = service_of(no_plans(tmp_path / "none"), review=True)
    with running(service) as address, visited(address, "/none/review") as page:
        says(page, "no plans to review")
        for key in ("ArrowRight", "k", "d", "Enter", "n"):
            page.keyboard.press(key)
        says(page, "no plans to review")


def test_a_build_is_looked_at_by_one_timer_that_outlives_a_failure(folder: Path) -> None:
    # the browser has a line of its own about the request that fails
    with running(service_of(folder, review=True)) as address, pytest.raises(AssertionError, match="503"):
        _look_at_a_build(address)


def _look_at_a_build(address: str) -> None:
    looks: list[str] = []

    def building(route: Any) -> None:
        """Answer that it is being built, until it was looked at twice; the first look fails."""
        is_look = route.request.url.endswith("/review/build")
        looks.extend([route.request.url] * is_look)
        phase = "built" if len(looks) == 2 else "building"
        told = {"phase": phase, "refusal": "", "waiting": 0, "lines": [], "outcomes": []}
        if is_look and len(looks) == 1:
            route.fulfill(status=503, json={"error": "out of breath"})
        else:
            route.fulfill(json=told if is_look else {**route.fetch().json(), "build": told})

    with visited(address, "/houses/review") as page:
        shows(page, "doubtful")
        page.route(re.compile("/review/(state|build)"), building)
        page.clock.install()
        for key, plan in (("Right", "middling"), ("Right", "sure"), ("Left", "middling"), ("Left", "doubtful")):
            page.keyboard.press(f"Arrow{key}")
            shows(page, plan)
        page.clock.run_for(700)
        says(page, "out of breath")
        assert len(looks) == 1
        with page.expect_response(re.compile("/review/state")):  # what was built is shown
            page.clock.run_for(700)
        page.wait_for_function("() => document.getElementById('build-words').textContent === 'Built.'")
        page.clock.run_for(7000)
        assert len(looks) == 2


def test_a_house_that_has_no_plan_after_a_build_shows_no_picture(folder: Path) -> None:
    outcome = {"plan": "shed", "became": "no plan", "why": "it is no house", "effects": [], "idle": []}
    told = {"phase": "built", "refusal": "", "waiting": 0, "lines": [], "outcomes": [outcome]}
    with running(service_of(folder, review=True)) as address, visited(address, "/houses") as page:
        page.route(
            re.compile("/review/state"), lambda route: route.fulfill(json={**route.fetch().json(), "build": told})
        )
        page.goto(f"{address}/houses/review")
        page.wait_for_selector(".outcome")
        assert page.inner_text(".outcome h3") == "shed: no plan: it is no house"
        assert page.locator(".outcome img").count() == 0


def test_it_works_on_a_phone_in_the_dark(folder: Path) -> None:
    with (
        running(service_of(folder, review=True)) as address,
        visited(address, "/houses/review?plan=middling", **PHONE) as page,
    ):
        shows(page, "middling")
        look(page, "review-phone")
        assert page.evaluate(
            "() => { const nav = document.querySelector('nav'); return nav.scrollWidth <= nav.clientWidth; }"
        )
        assert page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")
        page.tap("#keep")
        shows(page, "sure")
        assert overrides(folder) == {"middling": {"keep": True}}


def test_a_wall_that_closes_nothing_shows_the_gap_and_one_key_or_click_shuts_it(page: Any, folder: Path) -> None:
    def draw(*points: tuple[float, float]) -> None:
        page.keyboard.press("w")
        click(page, *points)
        page.wait_for_selector(".marks .gap", state="attached")
        assert "still open" in page.inner_text("#question")

    draw((2.0, 0.1), (2.0, 1.6))
    look(page, "review-gap")
    page.keyboard.press("1")
    says(page, "it parts a room")
    assert page.locator(".marks .gap").count() == 0
    draw((6.7, 0.1), (6.7, 1.6))
    click(page, (6.7, 2.4))
    says(page, "it parts a room")
    assert len(overrides(folder)["doubtful"]["wall"]) == 4


def test_an_opening_that_parts_nothing_yet_shows_where_the_room_is_open(page: Any, folder: Path) -> None:
    asked: list[Any] = []
    page.route("**/gap?*", lambda route: asked.append(route))  # noqa: PLW0108 - playwright asks a function for its name
    page.keyboard.press("p")
    click(page, (2.0, 0.1), (2.0, 1.6))
    says(page, "it waits for other lines")
    for _ in range(8):
        page.keyboard.press("+")
    view = page.get_attribute("#plan-drawing", "viewBox")
    asked[0].continue_()
    page.wait_for_selector(".marks .gap", state="attached")
    assert page.get_attribute("#plan-drawing", "viewBox") == view  # for what else is drawn
    page.keyboard.press("1")
    page.wait_for_function(
        "() => document.getElementById('effects').textContent.includes('opening, in the next build')"
    )
    assert "wall" in overrides(folder)["doubtful"]
    assert page.locator(".marks .gap").count() == 0


def test_the_door_of_what_is_no_room_is_asked_about_next(tmp_path: Path) -> None:
    folder = two_doubtful_rooms(tmp_path)
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "house")
        page.keyboard.press("2")  # no room
        page.wait_for_function("() => document.getElementById('question').textContent.includes('Does one walk in')")
        assert page.locator("#answers button").all_inner_texts()[2].split() == ["3", "No", "way"]
        page.keyboard.press("3")
        page.wait_for_function("() => document.getElementById('effects').textContent.includes('no door, in the next')")
        assert list(overrides(folder)["house"]) == ["no_room", "no_door"]


def test_a_click_in_the_picture_from_the_side_gives_the_height_of_a_floor(folder: Path) -> None:
    with running(service_of(folder, review=True)) as address:
        _click_a_floor(address)


def _click_a_floor(address: str) -> None:
    told = {
        "known": True,
        "why": "",
        "can_be_read": True,
        "said": {},
        "takes": ["units", "floors"],
        "floors": [0.0, 3.5],
    }
    asked = {"key": "floors of the file", "at": [1, 1], "says": "Floors were found.", "doubt": 1.0}
    asked["answers"] = [
        {"title": title, "action": action, "points": []} for title, action in (("Right", "leave"), ("Others", "file"))
    ]
    image = io.BytesIO()
    Image.new("L", (300, 180), 255).save(image, "PNG")
    png = base64.b64encode(image.getvalue()).decode()
    said, shown = list[dict[str, Any]](), dict[str, Any]()

    def state(route: Any) -> None:
        found = route.fetch().json()
        shown.update(found, source={**found["source"], **told}, questions=[asked])
        route.fulfill(json=shown)

    def source(route: Any) -> None:
        side = {"bounds": [0, -1.0, 10, 5.0], "png": png}
        route.fulfill(json={"layers": [], "edges": [], "places": [], "strokes": [], "side": side})

    def file(route: Any) -> None:
        said.append(route.request.post_data_json)
        route.fulfill(json=shown)

    with visited(address, "/houses") as page:
        for path, answer in (("state", state), ("source", source), ("file", file)):
            page.route(re.compile(f"/houses/review/{path}"), answer)
        page.goto(f"{address}/houses/review?plan=doubtful", wait_until="commit")
        page.wait_for_selector("#side:not([hidden])")
        page.keyboard.press("2")
        assert page.evaluate("() => document.activeElement.id") == "file-value"
        assert page.input_value("#file-value") == "0, 3.5"
        for id_, share in (("side", 0.75), ("file-side", 0.5)):  # 0.5 m in place of 0, then 2 m in place of all
            picture = page.locator(f"#{id_}")
            size = picture.bounding_box()
            picture.click(position={"x": size["width"] / 2, "y": share * size["height"]})
            assert page.evaluate("() => document.activeElement.id") == "file-value"
            if id_ == "side":
                assert page.input_value("#file-value").endswith(", 3.5")
                assert float(page.input_value("#file-value").split(",")[0]) == pytest.approx(0.5, abs=0.05)
        assert float(page.input_value("#file-value")) == pytest.approx(2.0, abs=0.05)
        page.keyboard.press("Enter")
        says(page, "Said of the file: floors")
        assert (said[0]["key"], float(said[0]["value"])) == ("floors", pytest.approx(2.0, abs=0.05))


def test_the_next_plan_stays_when_the_source_of_the_one_before_arrives(folder: Path) -> None:
    with running(service_of(folder, review=True)) as address:
        _keep_while_its_source_is_read(address)


def _keep_while_its_source_is_read(address: str) -> None:
    told = {"known": False, "why": "", "can_be_read": True, "said": {}}
    empty: dict[str, Any] = {"layers": [], "edges": [], "places": [], "strokes": []}
    waiting = list[Any]()

    def source(route: Any) -> None:
        waiting.append((route, empty))

    def state(route: Any) -> None:
        found = route.fetch().json()
        found["source"] |= told
        empty.setdefault("frame", found["frame"])
        if "move=open" in route.request.url:
            waiting.append((route, found))
        else:
            route.fulfill(json=found)

    def reply(count: int) -> None:
        for _ in range(100):
            if len(waiting) < count:
                page.wait_for_timeout(50)  # milliseconds
        route, found = waiting.pop(0)
        route.fulfill(json=found)
        page.wait_for_timeout(300)

    with visited(address, "/houses") as page:
        page.route(re.compile("/houses/review/(state|decide)"), state)
        page.route(re.compile("/houses/review/source"), source)
        page.goto(f"{address}/houses/review?plan=doubtful", wait_until="commit")
        shows(page, "doubtful")
        page.keyboard.press("k")
        reply(2)  # the source of the plan that is kept, and then the next plan
        told["known"] = True
        reply(1)
        reply(1)
        assert page.inner_text("#plan") == "middling"


def test_a_room_that_is_several_is_asked_about_where_it_parts_also_if_it_was_before(tmp_path: Path) -> None:
    folder = tmp_path / "houses"
    folder.mkdir()
    plan = replace(two_rooms("hall"), frame=FRAME)
    neck = [(0.1, 0.1), (0.1, 9.1), (4.1, 9.1), (4.1, 5.1), (2.1, 5.1), (2.1, 4.1), (4.1, 4.1), (4.1, 0.1)]  # of 2 m
    kitchen = replace(plan.rooms[0], ring=np.array(neck), confidence=0.6)
    save_plan(replace(plan, rooms=(kitchen, plan.rooms[1])), folder / "hall.json")
    with running(service_of(folder, review=True)) as address, visited(address, "/houses/review") as page:
        shows(page, "hall")
        page.wait_for_selector("#kinds:not([hidden])")
        assert "room of the house" in page.inner_text("#question")
        page.keyboard.press("4")
        says(page, "Several rooms, in hall")
        assert "No place is known" not in page.inner_text("#said")
        assert "narrower" in page.inner_text("#question")
