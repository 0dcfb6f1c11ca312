"""Review while something happens: another reviewer, a file that changes, a build that fails."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("starlette")

from typer.testing import CliRunner

from houseexpo import open_dataset
from houseexpo.commands.app import make_app as make_commands
from tests.builders.browsing import browser, visit, visited
from tests.builders.bungalow import FILE
from tests.builders.services import judged_later, running, service_of

pytestmark = [pytest.mark.slow, pytest.mark.browser]
LONG_MS = 120_000


def draw_wall(page: Any, *points: tuple[float, float]) -> None:
    script = """([x, y]) => {
      const place = new DOMPoint(x, -y).matrixTransform(document.getElementById("plan-drawing").getScreenCTM());
      return [place.x, place.y];
    }"""
    page.keyboard.press("w")
    for point in points:
        page.mouse.click(*page.evaluate(script, point))


def lists(page: Any, count: int) -> None:
    page.wait_for_function("n => document.querySelectorAll('#effects li').length === n", arg=count)


def contains(page: Any, place: str, words: str) -> None:
    script = "([place, words]) => document.querySelector(place).textContent.includes(words)"
    page.wait_for_function(script, arg=[place, words], timeout=LONG_MS)


def test_two_reviewers_undo_only_what_is_left_of_their_own(tmp_path: Path) -> None:
    folder = judged_later(tmp_path / "houses", {"house": 0.4})
    with (
        running(service_of(folder, review=True)) as address,
        browser() as opened,
        visit(opened, address, "/houses/review") as ann,
        visit(opened, address, "/houses/review") as ben,
    ):
        for page, name in ((ann, "ann"), (ben, "ben")):
            page.fill("#reviewer", name)
            page.focus("#stage")
        draw_wall(ann, (1.5, 3.1), (1.5, 0.1))
        lists(ann, 1)
        ben.keyboard.press("ArrowLeft")  # the same plan, as it is now
        lists(ben, 1)
        draw_wall(ben, (3.0, 3.1), (3.0, 0.1))
        lists(ben, 2)
        ben.locator("#effects .out").first.click()
        lists(ben, 1)
        ben.reload()
        lists(ben, 1)
        asked = {"reviewer": "ann", "plan": "house"}
        answer = ann.request.post(f"{address}/houses/review/undo", data=asked)
        assert "ann has no decision left to undo" in answer.text()  # ben has taken out what she said
        ben.keyboard.press("u")
        lists(ben, 2)
        ann.keyboard.press("u")
        lists(ann, 1)
        ben.keyboard.press("u")
        lists(ben, 0)
    assert not (folder / "overrides.toml").read_text().strip()


def test_a_file_that_changes_or_goes_loses_nothing_and_the_build_is_that_of_the_command(tmp_path: Path) -> None:
    file, plans = tmp_path / FILE.name, tmp_path / "plans"
    shutil.copy(FILE, file)
    words = ["build", str(file), "--workers", "1", "--out"]
    assert CliRunner().invoke(make_commands(), [*words, str(plans)]).exit_code == 0
    # the browser has a line of its own about the request for a source that is not there
    with running(service_of(plans, review=True)) as address, pytest.raises(AssertionError, match="400"):
        _review_while_it_changes(address, file)
    (tmp_path / "said").mkdir()
    for name in ("toml", "log.jsonl"):
        shutil.copy(plans / f"overrides.{name}", tmp_path / "said" / f"decisions.{name}")
    said = ["--overrides", str(tmp_path / "said" / "decisions.toml")]
    assert CliRunner().invoke(make_commands(), [*words, str(tmp_path / "again"), *said]).exit_code == 0
    (name,) = open_dataset(plans).ids
    assert open_dataset(plans).raw(name) == open_dataset(tmp_path / "again").raw(name)


def _review_while_it_changes(address: str, file: Path) -> None:
    with visited(address, "/plans/review") as page:
        page.wait_for_selector("#switches button", timeout=LONG_MS)
        draw_wall(page, (1.5, 0.2), (1.5, 5.8))
        lists(page, 1)
        file.write_text(file.read_text() + "\n# mended\n")
        page.keyboard.press("ArrowLeft")
        contains(page, "#said", "The file has changed since the plan was built")
        page.keyboard.press("9")  # the question that was there
        contains(page, "#question", "The file has changed since 1 correction was made here")
        page.keyboard.press("1")
        contains(page, "#history", "they hold")
        away = file.rename(file.with_suffix(".away"))
        _build(page, "The build failed:")
        assert page.locator("#effects li").count() == 1
        draw_wall(page, (3.0, 0.2), (3.0, 5.8))
        lists(page, 2)
        away.rename(file)
        _build(page, "Built.")
        contains(page, ".outcome h3", "changed")
        built = "() => [...document.querySelectorAll('#effects li')].every((li) => li.innerText.includes(', built: '))"
        page.wait_for_function(built, timeout=LONG_MS)  # the outcome comes before the plan is looked at again
        assert page.locator("#effects li").count() == 2


def _build(page: Any, words: str) -> None:
    page.focus("#stage")
    page.keyboard.press("b")
    page.wait_for_selector("#confirm:not([hidden])")
    page.keyboard.press("Enter")
    contains(page, "#build-words", words)
