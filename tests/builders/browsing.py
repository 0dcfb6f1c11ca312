"""A real browser on pages of the service: it fails on what a person would not want to happen."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import urlsplit

import numpy as np
import numpy.typing as npt

from houseexpo import FloorPlan
from houseexpo.service.drive.messages import HEAD, KIND, STEPS_PER_CELL
from tests.builders.needs import need


class Watch:
    """What happened on a page that must not: foreign requests, errors on the console, dialogs, failed answers."""

    def __init__(self, page: Any, address: str) -> None:
        self.faults: list[str] = []
        self._host = urlsplit(address).netloc
        page.on("request", self._asked)
        page.on("console", self._said)
        page.on("pageerror", lambda error: self.faults.append(f"error: {error}"))
        page.on("dialog", lambda dialog: (self.faults.append(f"dialog: {dialog.message}"), dialog.dismiss()))

    def _asked(self, request: Any) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in {"data", "blob"} and parts.netloc != self._host:
            self.faults.append(f"foreign request: {request.url}")

    def _said(self, message: Any) -> None:
        if message.type in {"error", "warning"} and "GPU stall due to ReadPixels" not in message.text:  # a screenshot
            self.faults.append(f"console: {message.text}")

    def check(self) -> None:
        """Fail where something happened."""
        assert not self.faults, self.faults


@contextmanager
def browser() -> Iterator[Any]:
    """Debian's Chromium, headless; skips where there is none."""
    need(modules=["playwright"], programs=["chromium"], how="apt-get install chromium")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        opened = driver.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", "--disable-gpu"]
        )
        try:
            yield opened
        finally:
            opened.close()


@contextmanager
def visit(opened: Any, address: str, path: str, **context: Any) -> Iterator[Any]:
    """A page of the service; what happened on it is checked at the end."""
    seen = opened.new_context(viewport={"width": 1280, "height": 860}, **context) if "viewport" not in context else None
    seen = seen or opened.new_context(**context)
    page = seen.new_page()
    watch = Watch(page, address)
    page.goto(address + path)
    page.wait_for_load_state("networkidle")
    try:
        yield page
        page.wait_for_load_state("networkidle")
        watch.check()
    finally:
        seen.close()


def barriers(page: Any) -> list[str]:
    """What axe finds that hinders people who use a screen reader, the keyboard or large letters: rule and place."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [f"{each['id']} ({each['impact']}): {node['target']}" for each in found for node in each["nodes"]]


TOO_WIDE = "() => document.documentElement.scrollWidth > document.documentElement.clientWidth + 1"


# What a browser does with a robot: it reads frames, adds them up to a map, and says what it has drawn.


VALUES = np.array([0, 127, 255], np.uint8)


class Frame(NamedTuple):
    flags: int
    bumps: int
    number: int
    steps: int
    pose: tuple[float, float, float]
    explored_m2: float
    coverage: float
    path_m: float
    rect: tuple[int, int, int, int]
    cells: npt.NDArray[np.uint8]
    bodies: npt.NDArray[np.float32]
    ranges: npt.NDArray[np.float64]


def frame_from(data: bytes) -> Frame:
    """Read a frame, run by run."""
    kind, flags, bumps, number, steps, *rest = HEAD.unpack_from(data)
    assert kind == KIND
    x, y, heading, explored, coverage, path, row, col, rows, cols, bodies, beams = rest
    at = HEAD.size
    places = np.frombuffer(data, "<f4", 6 * bodies, at).reshape(-1, 6)
    at += 24 * bodies
    ranges = np.frombuffer(data, "<u2", beams, at) / STEPS_PER_CELL
    cells: list[int] = []
    for run in np.frombuffer(data, "<u2", offset=at + 2 * beams).tolist():
        cells += [int(VALUES[run >> 14])] * (run & 0x3FFF)
    found = np.array(cells, np.uint8).reshape(rows, cols)
    rect = (row, col, rows, cols)
    return Frame(flags, bumps, number, steps, (x, y, heading), explored, coverage, path, rect, found, places, ranges)


def painted(known: npt.NDArray[np.uint8], frame: Frame) -> None:
    """Paint what changed on a map."""
    row, col, rows, cols = frame.rect
    known[row : row + rows, col : col + cols] = frame.cells


def two_rooms(name: str = "two_rooms") -> FloorPlan:
    """Return a house of two rooms of 4 x 4 m with a doorway between them."""
    ring = [
        (0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 2.6), (4.3, 2.6), (4.3, 4.1), (8.3, 4.1), (8.3, 0.1), (4.3, 0.1),
        (4.3, 1.6), (4.1, 1.6), (4.1, 0.1),
    ]  # fmt: skip
    return FloorPlan(name, ring, 2, {"Bedroom": [(0.1, 0.1, 4.1, 4.1)], "Kitchen": [(4.3, 0.1, 8.3, 4.1)]})


def start(**words: Any) -> dict[str, Any]:
    """Return the first message of a browser."""
    return {"do": "start", "plan": "two_rooms", **words}


# A page in a browser of its own, watched; and pictures of it for people to look at.


@contextmanager
def visited(address: str, path: str, **context: Any) -> Iterator[Any]:
    """Yield a page that ``browsing.visit`` watches; skips where there is no Chromium."""
    with browser() as opened, visit(opened, address, path, base_url=address, **context) as page:
        yield page


def look(page: Any, name: str) -> None:
    """Fail where a page as it stands hinders somebody; keep a picture of it where SCREENSHOTS names a folder."""
    if folder := os.environ.get("SCREENSHOTS"):
        page.screenshot(path=str(Path(folder) / f"{name}.png"))
    assert barriers(page) == []
