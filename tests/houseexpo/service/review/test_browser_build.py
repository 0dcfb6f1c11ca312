"""Build again in the browser: what runs is shown and confirmed; before and after stand side by side."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

pytest.importorskip("starlette")

from typer.testing import CliRunner

from houseexpo import open_dataset
from houseexpo.commands.app import make_app as make_commands
from houseexpo.service.review.decisions import DecisionStore
from tests.builders.browsing import look, visited
from tests.builders.bungalow import FILE
from tests.builders.services import running, service_of

pytestmark = [pytest.mark.slow, pytest.mark.browser]
LONG_MS = 180_000


def test_what_is_confirmed_is_built_and_before_and_after_are_shown(tmp_path: Path) -> None:
    (tmp_path / "houses").mkdir()
    shutil.copy(FILE, tmp_path / "houses")
    plans = tmp_path / "plans"
    words = ["build", str(tmp_path / "houses"), "--out", str(plans), "--workers", "1"]
    assert CliRunner().invoke(make_commands(), words).exit_code == 0
    with running(service_of(plans, review=True)) as address, visited(address, "/plans/review") as page:
        assert "doubtful" in page.inner_text("#facts")
        page.keyboard.press("r")
        for _ in range(2):
            page.keyboard.press("Shift+ArrowUp")
            page.keyboard.press("Shift+ArrowRight")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Enter")
        page.wait_for_function("() => document.getElementById('said').textContent.includes('is no room')")
        assert re.fullmatch(r"In the next build of .* is no room.* It is on the disk\.", page.inner_text("#said"))
        page.keyboard.press("b")
        assert str(tmp_path / "houses") in page.inner_text("#commands")
        assert str(plans / "overrides.toml") in page.inner_text("#confirm")
        look(page, "review-confirm")
        page.keyboard.press("Enter")
        page.wait_for_selector(".outcome", timeout=LONG_MS)
        assert "changed" in page.inner_text(".outcome h3")
        page.locator(".outcome").scroll_into_view_if_needed()
        page.wait_for_function(
            "() => [...document.querySelectorAll('.pair img')].filter((each) => each.naturalWidth).length === 2"
        )
        page.wait_for_function("() => document.getElementById('build-words').textContent === 'Built.'", timeout=LONG_MS)
        look(page, "review-built")
        assert page.inner_text("#build-words") == "Built."
    assert (plans / "overrides.toml").exists()


def test_a_build_in_a_terminal_is_known_and_nothing_is_coloured_that_did_not_change(tmp_path: Path) -> None:
    (tmp_path / "houses").mkdir()
    shutil.copy(FILE, tmp_path / "houses")
    plans = tmp_path / "plans"
    words = ["build", str(tmp_path / "houses"), "--out", str(plans), "--workers", "1"]
    assert CliRunner().invoke(make_commands(), words).exit_code == 0
    (name,) = open_dataset(plans).ids
    decisions = DecisionStore(plans / "overrides.toml")
    decisions.say_of_file(name, "units", "0.9", "ann")
    assert decisions.since_build() == [name]
    assert decisions.file_changed(name)
    assert CliRunner().invoke(make_commands(), words).exit_code == 0
    assert decisions.since_build() == []
    assert not decisions.file_changed(name)
    with running(service_of(plans, review=True)) as address, visited(address, "/plans/review") as page:
        page.wait_for_selector("#switches:not([hidden])", timeout=LONG_MS)
        page.wait_for_function("() => document.getElementById('said').textContent === ''", timeout=LONG_MS)
        assert page.inner_text("#build-words") == "No decisions since the last build."
        page.select_option("#file-key", "units")
        page.fill("#file-value", "1")
        page.press("#file-value", "Enter")
        page.wait_for_function(
            "() => document.getElementById('said').textContent.startsWith('This is the plan with')", timeout=LONG_MS
        )
        assert page.evaluate("document.activeElement.id") == "stage"
        assert page.locator(".gone path, .changed path").count() == 0
        bounds = page.locator("#plan-drawing image").first.evaluate(
            "each => ['x', 'y', 'width', 'height'].map((name) => Number(each.getAttribute(name)))"
        )
        views = []
        for _ in range(2):  # of the plan, and of all of the source
            page.keyboard.press("0")
            views.append([float(each) for each in page.get_attribute("#plan-drawing", "viewBox").split()])
        x, y, wide, high = max(views, key=lambda view: view[2])
        assert x < bounds[0]
        assert y < bounds[1]
        assert x + wide > bounds[0] + bounds[2]
        assert y + high > bounds[1] + bounds[3]
        page.select_option("#file-key", "drop_nodes")
        assert page.locator(".marks .named").count() == 0
        page.select_option("#file-names", index=0)
        assert page.locator(".marks .named").count() == 1
        page.select_option("#file-key", "units")
        assert page.locator(".marks .named").count() == 0
