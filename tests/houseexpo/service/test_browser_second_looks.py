"""The pages in Chromium where people look twice: on the way back, at a drawing's words, at a filter that went wrong."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytest.importorskip("starlette")

from tests.builders.browsing import TOO_WIDE, barriers, browser, visit
from tests.builders.services import built, furnished, published, running, service_of, some_plans, two_rooms

pytestmark = [pytest.mark.slow, pytest.mark.browser]
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
LONG = "x" * 150


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    home = tmp_path_factory.mktemp("looked")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOUSEEXPO_CACHE", str(home / "cache"))
        homes = built(home / "homes", [*some_plans(), two_rooms("narrow", 0.3, label="Passenger_elevator")])
        others = published(home / "published.jsonl", 400), built(home / "long", [two_rooms(LONG), furnished("full")])
        service = service_of(homes, *others)
        with running(service) as found:
            yield found


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as opened:
        yield opened


def said(page: Any, place: str, words: str) -> None:
    from playwright.sync_api import expect

    expect(page.locator(place)).to_contain_text(words, timeout=15_000)


def boxes(page: Any, place: str) -> list[dict[str, float]]:
    """The rectangles on the screen of all that is seen at a place."""
    found: list[dict[str, float]] = page.evaluate(
        """(place) => [...document.querySelectorAll(place)].map((each) => each.getBoundingClientRect().toJSON())
        .filter((box) => box.width > 0)""",
        place,
    )
    return found


def test_who_comes_back_from_a_plan_finds_the_place(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/published/") as page:
        page.wait_for_selector("a.plan img")
        page.evaluate("scrollTo(0, 4000)")
        page.wait_for_selector('[data-number="100"] img')
        before = page.evaluate("scrollY")
        page.click('[data-number="100"]')
        page.wait_for_selector("#drawing svg")
        page.go_back()
        page.wait_for_selector('[data-number="100"] img')
        assert page.evaluate("scrollY") == pytest.approx(before, abs=200)  # the click brings a plan into sight whole


def test_a_word_is_one_step_back(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/") as page:
        page.wait_for_selector("a.plan img")
        page.locator("#text").press_sequentially("garage", delay=300)
        said(page, "#count", "1 of 5 plans")
        assert page.url.endswith("text=garage")
        page.go_back()
        said(page, "#count", "5 plans")
        assert page.url.endswith("/homes/")


def test_the_end_that_is_typed_counts(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/?area=15..25") as page:
        page.wait_for_selector("a.plan img")
        page.fill('input[aria-label="Free area, from"]', "30")
        page.press('input[aria-label="Free area, from"]', "Enter")
        page.wait_for_url("**/homes/?area=30..")
        said(page, "#count", "1 of 5 plans")


def test_a_view_that_is_refused_can_be_left(chromium: Any, address: str) -> None:
    page = chromium.new_context().new_page()  # the console has a line about what is refused
    page.goto(f"{address}/homes/?sort=colour")
    said(page, "#message", "cannot be shown")
    assert barriers(page) == []
    page.click("#clear")
    said(page, "#count", "5 plans")
    page.context.set_offline(True)
    page.click('[data-label="Garage"]')
    said(page, "#message", "the server does not answer")
    page.context.close()


def test_sizes_stand_beside_the_plan_and_words_in_their_rooms(chromium: Any, address: str) -> None:
    for look in ({}, PHONE):
        with visit(chromium, address, "/homes/plan/a1", **look) as page:
            page.check('[data-layer="frame"]')
            (wall,) = boxes(page, ".wall")[:1]
            below, left = boxes(page, ".measure")
            assert below["top"] >= wall["bottom"]
            assert left["right"] <= wall["left"]
            assert page.evaluate("getComputedStyle(document.querySelector('.measure')).stroke") == "none"
            for word in boxes(page, ".in-room"):
                rooms = [room for room in boxes(page, ".room") if room["left"] <= word["left"] <= room["right"]]
                assert any(word["right"] <= room["right"] + 1 for room in rooms)


def test_words_wait_until_their_room_is_large_enough(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/plan/narrow") as page:
        page.wait_for_selector("#drawing svg")
        assert len(boxes(page, ".in-room")) == 4
        for _ in range(6):
            page.click("#farther")
        assert len(boxes(page, ".in-room")) == 2  # the bedroom's alone


def test_a_furnished_room_has_its_name_too(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/long/plan/full") as page:
        page.wait_for_selector("#drawing svg")
        assert len(boxes(page, ".in-room")) == 4


def test_what_is_chosen_can_be_read_and_reached(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/?labels=Kitchen&without=Garage") as page:
        said(page, "#count", "of 5 plans")
        assert barriers(page) == []
        edge = page.evaluate("document.querySelector('.filters').getBoundingClientRect().right")
        page.evaluate("document.getElementById('measure-reach').hidden = false")  # has a choice of radius too
        assert all(each["right"] <= edge for each in boxes(page, ".measure :is(input, select)"))


def test_two_fingers_zoom_about_the_one_that_rests(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/plan/a1", **PHONE) as page:
        page.wait_for_selector("#drawing svg")
        place = page.locator("#drawing svg").bounding_box()
        x, y = place["x"] + place["width"] / 2, place["y"] + place["height"] / 2
        fingers = page.context.new_cdp_session(page)

        def touch(kind: str, *xs: float) -> None:
            points = [{"x": each, "y": y, "id": number} for number, each in enumerate(xs)]
            fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        def scale() -> float:
            return float(page.evaluate("document.querySelector('#drawing svg').getScreenCTM().a"))

        before = scale()
        touch("touchStart", x)
        touch("touchStart", x, x + 40)
        for step in (60, 80):
            touch("touchMove", x, x + step)
        touch("touchEnd")
        assert scale() == pytest.approx(2 * before, rel=0.05)
        assert page.input_value("#from") == ""  # no finger meant a place
        page.touchscreen.tap(x, y)
        said(page, "#way", "Click the end of the path.")
        middle = [float(each) for each in page.input_value("#from").split(",")]
        assert middle == pytest.approx([3.65, 1.6], abs=0.1)  # the plan's own: the finger that rested was there


def test_statistics_of_nothing_say_so(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/statistics?rooms=99") as page:
        said(page, "#what", "0 of 5 plans. rooms=99")
        said(page, "#what", "No plan meets this filter.")
        assert page.inner_text("#figures") == ""


def test_bars_are_named_by_what_they_hold(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/statistics") as page:
        page.wait_for_selector(".figure table")
        cards = page.locator(".figure")
        doors = cards.filter(has_text="Doors").first
        assert doors.locator("svg").count() == 0  # each has one door: a block says less than a sentence
        assert "1 in all 5 plans that state it." in doors.inner_text()


@pytest.mark.parametrize("path", [f"/long/plan/{LONG}", f"/long/drive?plan={LONG}", "/homes/refused", "/api"])
def test_nothing_is_wider_than_a_phone(chromium: Any, address: str, path: str) -> None:
    with visit(chromium, address, path, **PHONE) as page:
        assert not page.evaluate(TOO_WIDE)
        assert page.evaluate("innerWidth") == 390
        assert not page.evaluate("[...document.querySelectorAll('.scrolls')].some((each) => each.scrollWidth > 390)")
