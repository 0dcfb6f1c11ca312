"""Review as a person does it: with the keyboard alone, and with clicks."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")

from tests.builders.browsing import look, visited
from tests.builders.services import judged_later, no_plans, running, service_of

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
    page.wait_for_function("() => document.getElementById('picture').complete")


def says(page: Any, words: str) -> None:
    page.wait_for_function("words => document.getElementById('said').textContent.includes(words)", arg=words)


def overrides(folder: Path) -> dict[str, Any]:
    return tomllib.loads((folder / "overrides.toml").read_text())


def test_the_keyboard_alone_is_enough(page: Any, folder: Path) -> None:
    press = page.keyboard.press
    press("d")
    press("Shift+ArrowRight")
    press("Shift+ArrowUp")
    for _ in range(6):
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
    assert "2 of 2 doubtful plans reviewed" in page.inner_text("#progress-words")
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


def test_a_door_is_two_clicks_where_it_is_seen(page: Any, folder: Path) -> None:
    page.click("#door")
    box = page.locator("#marks").bounding_box()
    at = page.evaluate("() => fetch('review/state').then((answer) => answer.json())")["picture"]
    for x, y in ((0.0, 2.0), (0.0, 3.0)):
        across = (x - at["origin"][0]) * at["ppm"] / at["size"][0]
        down = 1 - (y - at["origin"][1]) * at["ppm"] / at["size"][1]
        page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])
    says(page, "In the next build of doubtful: an entrance of 1.00 m")
    assert overrides(folder)["doubtful"]["door"] == [
        pytest.approx([10.0, 0.0], abs=0.02), pytest.approx([10.0, 1.0], abs=0.02)
    ]  # fmt: skip


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
