"""The site of docs/: it builds without a warning, and a page asks no other host for anything."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.builders.browsing import browser
from tests.builders.needs import need

ROOT = Path(__file__).resolve().parents[1]
LOADED = re.compile(r"""<(?:script|img|iframe|source)\b[^>]*\bsrc=["\']([^"\']+)|<link\b[^>]*\bhref=["\']([^"\']+)""")
IN_STYLES = re.compile(r"(?:url\(|@import\s+)[\"\']?(?:https?:)?//")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("sphinx", reason="make docs installs Sphinx")
    out = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--quiet", str(ROOT / "docs"), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return out


@pytest.mark.slow
def test_no_page_asks_another_host(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 20
    for page in pages:
        loaded = [one or other for one, other in LOADED.findall(page.read_text())]
        assert loaded
        assert not [place for place in loaded if place.startswith(("http:", "https:", "//"))], page.name
    assert not [file.name for file in site.rglob("*.css") if IN_STYLES.search(file.read_text())]


@pytest.mark.slow
def test_the_reference_has_every_public_name(site: Path) -> None:
    import houseexpo

    text = (site / "reference" / "houseexpo.html").read_text()
    told = set(re.findall(r'id="houseexpo\.([\w.]+)"', text))
    missing = {name for name in houseexpo.__all__ if name not in told and f"errors.{name}" not in told}
    assert missing <= {"LABELS", "UNLABELLED"}  # the format's page lists the labels


PAGES = (
    "index",
    "genindex",
    "guide-pipeline",
    "leaderboard",
    "readers/analysis",
    "reference/houseexpo",
    "reference/stats",
)
WIDTHS = (360, 768, 1024, 1360, 1440)


@pytest.mark.slow
@pytest.mark.browser
def test_pages_fit_the_window_and_break_no_rule_of_accessibility(site: Path) -> None:
    need(modules=["axe_playwright_python"], how="make setup")
    from axe_playwright_python.sync_playwright import Axe

    with browser() as opened:
        page = opened.new_page()
        for name in PAGES:
            page.goto((site / f"{name}.html").as_uri())
            for width in WIDTHS:
                page.set_viewport_size({"width": width, "height": 900})
                wide = page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth")
                assert wide <= 0, (name, width, wide)
            broken = Axe().run(page).response["violations"]
            assert not [rule["id"] for rule in broken if rule["impact"] in {"critical", "serious"}], name
