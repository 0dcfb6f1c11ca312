"""Take the pictures of the service's pages: ``make screenshots``; needs Debian's Chromium and the demo data set.

The server runs as a person starts it, and a browser visits its pages. What the pages ask for from elsewhere, or say on
the console, ends the run.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

IMAGES = Path(__file__).parents[1] / "images"
WIDE = {"width": 1280, "height": 800}
_WAIT_MS = 120_000
_EXPLORES_MS = 12_000


def shoot(data_set: Path, images: Path = IMAGES) -> None:
    """Write a picture of each page of a served data set."""
    with serving(data_set) as address, sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        home = f"{address}/{data_set.name}"
        with page_of(chromium, "light") as page:
            page.goto(f"{home}/", wait_until="networkidle")
            page.screenshot(path=images / "serve_gallery.png")
            page.goto(f"{home}/?view=table&sort=-area", wait_until="networkidle")
            page.screenshot(path=images / "serve_table.png")
            page.goto(f"{home}/", wait_until="networkidle")
            first = page.locator("a[href*='/plan/']").first.get_attribute("href") or ""
            page.goto(f"{address}/{first.lstrip('/')}", wait_until="networkidle")
            page.screenshot(path=images / "serve_plan.png")
            page.goto(f"{home}/statistics", wait_until="networkidle")
            page.screenshot(path=images / "serve_statistics.png")
            page.goto(f"{home}/review", wait_until="networkidle")
            page.get_by_label("Reviewer").fill("Ada")
            page.locator("h3 code").evaluate(
                "(node) => { node.textContent = node.textContent.split('/').slice(-3).join('/'); }"
            )
            page.screenshot(path=images / "serve_review.png")
        with page_of(chromium, "dark") as page:
            page.goto(f"{home}/drive", wait_until="networkidle")
            page.locator("dd.seen", has_text=re.compile(r"[1-9]\d*%")).first.wait_for(timeout=_WAIT_MS)
            page.get_by_label("Driver").first.select_option("frontier")
            page.get_by_label("Explorers").first.fill("30")
            page.get_by_role("button", name="Start", exact=True).click()
            page.locator("dd.way", has_text=re.compile("[1-9]")).first.wait_for(timeout=_WAIT_MS)  # it is compiled
            page.wait_for_timeout(_EXPLORES_MS)
            page.screenshot(path=images / "serve_drive.png")
        chromium.close()


@contextmanager
def serving(data_set: Path) -> Iterator[str]:
    """Run ``houseexpo serve`` on a free port; yields its address."""
    command = [sys.executable, "-m", "houseexpo", "serve", str(data_set), "--port", "0", "--review"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)  # noqa: S603  # our own words
    try:
        for line in server.stdout or ():
            if found := re.search(r"http://[\w.:]+", line):
                yield found[0]
                return
        raise SystemExit(f"houseexpo serve {data_set} ended before it said where it is")
    finally:
        server.terminate()
        server.wait(10)


@contextmanager
def page_of(chromium: Any, scheme: str) -> Iterator[Any]:
    """Open a page in a light or a dark browser of its own; raises where the page says something went wrong."""
    said: list[str] = []
    context = chromium.new_context(viewport=WIDE, color_scheme=scheme)
    page = context.new_page()
    page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: said.append(str(error)))
    yield page
    context.close()
    if said:
        raise SystemExit(f"the pages said: {said}")


if __name__ == "__main__":
    shoot(Path(sys.argv[1]))
