"""A page in a browser of its own, watched; and pictures of it for people to look at."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.builders.browsing import barriers, browser, visit


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
