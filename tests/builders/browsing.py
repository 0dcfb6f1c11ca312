"""A real browser on a page of the service; it fails on what a person would not want to happen."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

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
        if message.type in {"error", "warning"}:
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
