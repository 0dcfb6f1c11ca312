"""One house, one command: it is built, corrected on the page, and built again with what was said."""

from __future__ import annotations

import io
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

pytest.importorskip("starlette")

from houseexpo import open_dataset
from tests.builders.browsing import look, visited
from tests.builders.examples import FOLDER
from tests.builders.services import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.browser]
RUN = "import typer; from houseexpo.commands.review import review; typer.run(review)"

WITHOUT_WEBGL = """HTMLCanvasElement.prototype.getContext = ((own) => function (kind, ...more) {
  return kind === "webgl2" ? null : own.call(this, kind, ...more);
})(HTMLCanvasElement.prototype.getContext);"""


def test_one_command_and_a_few_keys_correct_a_house(tmp_path: Path) -> None:
    house = Path(shutil.copy(FOLDER / "house.ifc", tmp_path))
    environment = {**os.environ, "HOUSEEXPO_CACHE": str(tmp_path / "cache")}
    command = [sys.executable, "-c", RUN, str(house), "--no-open", "--workers", "1"]
    server = subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        found = next(filter(None, (re.search(r"open (http://[\w.:]+)(\S+) in", line) for line in server.stdout)))
        (folder,) = (tmp_path / "cache" / "reviews").glob("*/house")
        before = open_dataset(folder)[0]
        with visited(found[1], found[2]) as page:
            page.wait_for_selector("#plan-drawing")
            look_at_it_in_three_dimensions(page)
            page.fill("#reviewer", "ann")
            page.focus("#stage")
            page.keyboard.press("t")
            page.keyboard.press("Escape")
            place = before.doors[0].polygon.centroid
            x, y = page.evaluate(
                "([x, y]) => { const at = new DOMPoint(x, -y).matrixTransform("
                "document.getElementById('plan-drawing').getScreenCTM()); return [at.x, at.y]; }",
                [place.x, place.y],
            )
            page.keyboard.press("t")
            page.mouse.click(x, y)
            page.wait_for_function("() => document.getElementById('said').textContent.includes('is wall')")
            page.focus("#stage")
            page.keyboard.press("b")
            page.keyboard.press("Enter")
            page.wait_for_function(
                "() => document.getElementById('build-words').textContent.startsWith('Built')", timeout=120_000
            )
        after = open_dataset(folder)[0]
        assert before.doors[0].segment not in {door.segment for door in after.doors}
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(20)


def look_at_it_in_three_dimensions(page: Any) -> None:
    switch, view = page.get_by_role("button", name="In three dimensions"), page.locator("#solid-view")
    switch.click()
    page.wait_for_function(
        "() => document.getElementById('solid-view').width !== 300"
    )  # it was drawn: 300 is a canvas' own width
    drawn = [view.screenshot()]
    assert len(Image.open(io.BytesIO(drawn[0])).convert("L").getcolors() or []) > 20
    view.press("ArrowLeft")
    view.press("+")
    cut = page.locator("#solid-cut")
    cut.fill("1")
    cut.press("ArrowRight")
    assert cut.input_value() == "1.1"
    drawn.append(view.screenshot())
    assert drawn[0] != drawn[1]
    look(page, "review-solid")
    page.keyboard.press("v")  # the slider has the focus
    assert view.is_hidden()
    page.add_init_script(WITHOUT_WEBGL)
    page.reload()
    page.wait_for_selector("#switches button")
    assert switch.count() == 0
