"""The pages as a person uses them, in Chromium: nothing foreign is asked for, nothing fails, no dialog comes up."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.png import encode_png
from tests.builders.browsing import TOO_WIDE, barriers, browser, visit
from tests.builders.services import built, published, running, service_of, some_plans

pytestmark = [pytest.mark.slow, pytest.mark.browser]

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True, "device_scale_factor": 2}
LOOKS: dict[str, dict[str, Any]] = {
    "light": {"color_scheme": "light"},
    "dark": {"color_scheme": "dark"},
    "phone": {"color_scheme": "light", **PHONE},
}
PAGES = {
    "start": "/",
    "about": "/homes/about",
    "gallery": "/homes/",
    "plan": "/homes/plan/a1",
    "refused": "/homes/refused",
    "statistics": "/homes/statistics",
    "api": "/api",
}


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    home = tmp_path_factory.mktemp("shown")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOUSEEXPO_CACHE", str(home / "cache"))
        homes = built(home / "homes", some_plans(), ("a1", "c3"))
        (homes / "stages").mkdir()
        (homes / "stages" / "a1.png").write_bytes(encode_png(np.full((500, 2000, 3), 220, np.uint8)))
        with running(service_of(homes, published(home / "published.jsonl", 400))) as found:
            yield found


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as opened:
        yield opened


def said(page: Any, place: str, words: str | re.Pattern[str]) -> None:
    """Wait until a place of the page says something."""
    from playwright.sync_api import expect

    expect(page.locator(place)).to_have_text(words, timeout=15_000)


def count(page: Any) -> str:
    page.wait_for_load_state("networkidle")
    return str(page.inner_text("#count"))


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_whole_in_every_look(chromium: Any, address: str, name: str, look: str) -> None:
    with visit(chromium, address, PAGES[name], **LOOKS[look]) as page:
        assert barriers(page) == []
        assert not page.evaluate(TOO_WIDE)
        assert page.locator("h1").count() == 1


def test_thousands_scroll_in_a_page_that_holds_dozens(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/published/") as page:
        assert count(page) == "400 plans"
        assert page.locator("a.plan").count() < 120
        page.evaluate("scrollTo(0, document.body.scrollHeight)")
        page.wait_for_selector('[data-number="399"] .id')
        assert page.locator("a.plan").count() < 120
        assert page.locator('[data-number="399"] .id').inner_text() == f"{399:032x}"


def test_filters_combine_and_the_address_holds_them(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/") as page:
        page.click('[data-label="Garage"]')
        said(page, "#count", "1 of 4 plans")
        assert "labels=Garage" in page.url
        page.click('[data-label="Garage"]')  # now: without it
        said(page, "#count", "3 of 4 plans")
        page.fill('#measure-quality input[aria-label$="from"]', "0.8")
        page.press('#measure-quality input[aria-label$="from"]', "Enter")
        said(page, "#count", "2 of 4 plans")
        link = page.url
        page.select_option("#sort", "quality")
        said(page, '[data-number="0"] .id', "d 4&é")
        assert page.locator("#conditions button").count() == 2
        page.go_back()
        page.wait_for_url(link)
        page.go_back()
        said(page, "#count", "3 of 4 plans")
    with visit(chromium, address, link.removeprefix(address)) as page:
        assert count(page) == "2 of 4 plans"
        assert page.get_attribute('[data-label="Garage"]', "data-state") == "without"
        page.click("#conditions button:has-text('without Garage')")  # each can be taken off by itself
        page.wait_for_selector("#conditions button:only-child")
        page.click("#clear")
        said(page, "#count", "4 plans")


def test_plans_are_sorted_by_what_is_known_and_say_it_first(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/published/?sort=-vertices") as page:
        page.wait_for_selector("a.plan img")
        words = page.locator('[data-number="0"] .facts').inner_text()
        assert words.startswith("vertices ")  # the end of a line is cut off
        shown = page.locator("#sort option:not([hidden])").evaluate_all("(all) => all.map((each) => each.value)")
        assert {"id", "source_rooms", "area", "vertices"} <= set(shown)
        assert not {"quality", "rooms", "doors", "reach"} & set(shown)  # published plans record none of them


def test_a_range_is_brushed(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/published/") as page:
        box = page.locator("#measure-area svg").bounding_box()
        page.mouse.move(box["x"] + 2, box["y"] + 20)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] / 4, box["y"] + 20)
        page.mouse.up()
        page.wait_for_url(re.compile("area="))
        said(page, "#count", re.compile("^[0-9]+ of 400 plans$"))
        found = int(count(page).split(" ")[0])
        assert 60 < found < 140


def test_words_are_searched_while_they_are_typed(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/") as page:
        page.type("#text", "b2")
        said(page, "#count", "1 of 4 plans")
        page.fill("#text", "nothing like it")
        page.wait_for_selector("#nothing:not([hidden])")
        page.click('[data-label="Garage"]')
        page.click("#nothing button:has-text('nothing like it')")  # which condition to take off, and what it leaves
        said(page, "#count", "1 of 4 plans")


def test_arrow_keys_walk_from_plan_to_plan(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/published/") as page:
        page.wait_for_selector('[data-number="0"] .id')
        page.focus('[data-number="0"]')
        page.keyboard.press("ArrowRight")
        assert page.evaluate("document.activeElement.dataset.number") == "1"
        for _ in range(12):
            page.keyboard.press("ArrowDown")
        number = int(page.evaluate("document.activeElement.dataset.number"))
        assert number > 40
        page.wait_for_selector(f'[data-number="{number}"][href]')
        page.keyboard.press("Enter")
        page.wait_for_url(re.compile("/published/plan/"))


def test_three_keys_lead_to_the_first_plan_and_the_plans_are_one_stop(chromium: Any, address: str) -> None:
    number = "document.activeElement.dataset.number"
    with visit(chromium, address, "/published/") as page:
        page.wait_for_selector('[data-number="0"][href]')
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.textContent") == "Skip to the plans"
        assert page.locator(".skip:focus").bounding_box()["x"] >= 0
        page.keyboard.press("Enter")
        assert page.evaluate(number) == "0"
        for _ in range(3):
            page.keyboard.press("ArrowRight")
        page.keyboard.press("Tab")
        assert page.evaluate(number) is None  # one stop, not four hundred
        page.keyboard.press("Shift+Tab")
        assert page.evaluate(number) == "3"  # where it was left
        page.keyboard.press("End")
        assert page.evaluate(number) == "399"
        page.keyboard.press("PageUp")
        assert int(page.evaluate(number)) < 399
        page.keyboard.press("Home")
        assert page.evaluate(number) == "0"
        page.evaluate("document.activeElement.blur()")
        page.evaluate("scrollTo(0, document.body.scrollHeight)")
        page.wait_for_selector('[data-number="399"][href]')
        stops = page.locator('a.plan[tabindex="0"]')
        assert stops.count() == 1
        assert int(stops.get_attribute("data-number")) > 300  # the first in sight
        numbers = page.locator("a.plan").evaluate_all("(all) => all.map((each) => Number(each.dataset.number))")
        assert numbers == sorted(numbers)


def test_a_slider_that_moves_on_ends_what_it_asked_for(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/plan/a1") as page:
        ended = []
        page.on("requestfailed", lambda request: ended.append(request.url.rpartition("/")[2]))
        page.route("**/reach?radius=0.45", lambda _: None)  # it is never answered
        with page.expect_request("**/reach?radius=0.45"):
            page.locator("#radius").fill("0.45")
        page.locator("#radius").fill("0.2")
        said(page, "#reached", re.compile("^The robot reaches every place"))
        assert ended == ["reach?radius=0.45"]


def test_a_plan_is_measured_by_hand(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/plan/a1") as page:
        page.wait_for_selector("#drawing svg path.room")
        page.uncheck('[data-layer="rooms"]')
        assert not page.is_visible("#drawing path.room")
        page.check('[data-layer="grid"]')
        assert page.evaluate("document.querySelector('#drawing g.grid').style.display") == ""
        page.check('[data-layer="clearance"]')
        page.wait_for_selector("#drawing image")
        page.locator("#radius").fill("0.45")
        said(page, "#reached", re.compile("^2 pieces"))
        page.locator("#radius").fill("0.2")
        said(page, "#reached", re.compile("^The robot reaches every place"))
        box = page.locator("#drawing svg").bounding_box()
        place = page.evaluate(
            """([x, y]) => { const svg = document.querySelector('#drawing svg');
            const at = new DOMPoint(x, -y).matrixTransform(svg.getScreenCTM()); return [at.x, at.y]; }""",
            [1.1, 1.5],
        )
        assert box["x"] < place[0] < box["x"] + box["width"]
        page.mouse.click(*place)
        page.fill("#to", "6.2, 1.5")
        page.press("#to", "Enter")
        said(page, "#way", re.compile(r"^5\.1\d m"))
        with page.expect_download() as download:
            page.click(".formats a[download]:has-text('svg')")
        assert Path(download.value.path()).read_bytes().startswith(b"<svg")
        page.keyboard.press("n")
        page.wait_for_url(re.compile("/homes/plan/b2"))


@pytest.mark.parametrize("look", ["light", "phone"])
def test_stages_are_fetched_when_they_are_looked_at(chromium: Any, address: str, look: str) -> None:
    with visit(chromium, address, "/homes/plan/a1", **LOOKS[look]) as page:
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url.rpartition("/")[2]))
        page.wait_for_load_state("networkidle")
        page.click("#evidence details:not(#stages) summary")
        assert page.is_visible("#evidence td:has-text('Kitchen and Bedroom')")
        assert "stages.png" not in asked
        page.click("#stages summary")
        page.locator("#stages img").scroll_into_view_if_needed()
        page.wait_for_function("() => document.querySelector('#stages img').naturalWidth === 2000")
        assert "stages.png" in asked
        assert barriers(page) == []
        assert not page.evaluate(TOO_WIDE)  # the picture scrolls in its own place


def test_rooms_are_found_where_there_are_none(chromium: Any, address: str) -> None:
    with visit(chromium, address, f"/published/plan/{3:032x}") as page:
        page.wait_for_selector("#drawing path.room")
        said(page, "#finding", re.compile("Found: 1 room, 0 doors"))
        assert page.is_checked('[data-layer="rooms"]')
        page.click("#find-rooms")  # what the file records
        assert page.is_checked('[data-layer="boxes"]')
        assert not page.is_checked('[data-layer="rooms"]')


def test_a_table_has_the_columns_that_were_chosen_and_is_sorted_by_its_head(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/") as page:
        page.click("#as-table")
        page.wait_for_selector("#plans.lines .tile img")
        assert barriers(page) == []
        page.click("#choose summary")
        page.evaluate("""() => {  // both before the page is drawn again
          const labels = [...document.querySelectorAll("#column-names label")];
          for (const words of ["Labels", "Longer side"]) labels.find((each) => each.textContent === words).click();
        }""")
        page.click("#choose summary")  # its list lies over the head
        page.click('#head [data-column="area"]')
        page.click('#head [data-column="area"]')
        page.wait_for_url(re.compile("sort=-area"))
        said(page, '[data-number="0"] .id', "c3")
        assert "Longer side" in page.inner_text("#head")
        assert "Labels" not in page.inner_text("#head")
    with visit(chromium, address, "/homes/?view=table&columns=doors") as page:
        page.wait_for_selector("#plans.lines .tile img")
        assert page.locator('#head [role="columnheader"]').count() == 2


def test_plans_are_selected_and_downloaded(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/") as page:
        page.wait_for_selector("a.plan img")
        page.focus('[data-number="0"]')
        page.keyboard.press("x")
        page.keyboard.press("Shift+ArrowRight")
        page.keyboard.press("Shift+ArrowRight")
        said(page, "#selected", "3 plans selected")
        assert barriers(page) == []
        with page.expect_download() as download:
            page.select_option("#form-of-download", "geojson")
            page.click('[data-does="download"]')
        assert download.value.suggested_filename == "homes-geojson.zip"
        page.click('[data-does="clear"]')
        assert not page.is_visible("#selection")


def test_another_data_set_is_one_choice_away(chromium: Any, address: str) -> None:
    with visit(chromium, address, "/homes/") as page:
        page.select_option("#data-set", "/published/")
        page.wait_for_url(re.compile("/published/$"))
        assert count(page) == "400 plans"
