from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from houseexpo.commands.app import make_app
from houseexpo.dataset import open_dataset
from houseexpo.floorplan import FloorPlan
from stats.html_report import report_html, write_statistics
from stats.measure import DataSetSummary, measure_plans, summarise_data_set, summarise_records
from stats.report import Report, count_leaks
from stats.terminal_tables import report_tables
from tests.stats.conftest import outline


def run(*arguments: object) -> None:
    with pytest.raises(SystemExit) as ended:
        make_app()(args=["stats", *map(str, arguments)])
    assert ended.value.code == 0


class Tags(HTMLParser):
    """Counts what opens, and fails where something else closes."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:  # noqa: ARG002 - HTMLParser's
        self.seen.append(tag)
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_a_data_set_in_splits(folder: Path) -> None:
    found = summarise_data_set(open_dataset(folder), workers=1)
    assert found.whole.plans == 5
    assert {name: part.plans for name, part in found.splits.items()} == {"train": 3, "test": 2}
    assert found.listed == {"train": 4, "test": 2}
    assert count_leaks(found) == {"train": {"test": 1}, "test": {"train": 1}}, "h3 and h4 are one house"
    assert found.whole.report()["rings"]["repeats"] == 1


def test_the_page_stands_alone(folder: Path) -> None:
    data_set = open_dataset(folder)
    measured = measure_plans(data_set, workers=1)
    one = summarise_records(data_set, measured)
    html = report_html(Report(one, summarise_data_set(data_set, workers=1)))
    tags = Tags()
    tags.feed(html)
    assert not tags.open
    assert not {"script", "link", "img", "iframe"} & set(tags.seen)
    assert not re.search(r"(?:src|href)=\"(?!#)|url\((?!#)|@import", html)
    assert "#010101" not in html, "every colour of a plot is the page's"
    assert "prefers-color-scheme: dark" in html
    assert "width=device-width" in html
    for words in ("Label boxes", "Wasserstein-1", "total variation"):
        assert words in html


def test_the_same_plans_give_the_same_page_and_the_same_numbers(folder: Path, tmp_path: Path) -> None:
    data_set = open_dataset(folder)
    one, other = (Report(summarise_data_set(data_set, workers=1)) for _ in range(2))
    assert report_html(one) == report_html(other)
    for name, report in (("one.json", one), ("other.json", other)):
        write_statistics(report, tmp_path / name)
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "other.json").read_bytes()


@pytest.mark.slow
def test_data_sets_that_lack_what_the_other_has_are_compared(ring_of_rooms: FloorPlan) -> None:
    """One plan without labels; two plans; rooms; a plan in which no robot fits."""
    plain = [replace(outline(name, width), room_category={}) for name, width in (("a", 4.0), ("b", 6.0))]
    kinds = [plain[:1], plain, [*plain, outline("c")], [ring_of_rooms], [ring_of_rooms, *plain], [outline("d", 0.2)]]
    summaries = []
    for number, plans in enumerate(kinds):
        summaries.append(DataSetSummary(f"kind {number}"))
        for plan in plans:
            summaries[-1].whole.add(plan)
    for one in summaries:
        for other in (None, *summaries):
            html = report_html(Report(one, other))
            assert not re.search(r"\bnan\b|\bNone\b", html)
            has_labels = bool(one.whole.labels or (other and other.whole.labels))
            assert ("<h3>Labels</h3>" in html) == has_labels
            titles = [table.title for table in report_tables(Report(one, other))]
            assert ("Labels" in titles) == bool(one.whole.labels)


def test_the_command_writes_page_and_numbers(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out, numbers = tmp_path / "report.html", tmp_path / "report.json"
    run(folder, "--out", out, "--out", numbers, "--compare", folder, "--workers", 1)
    assert out.read_text().startswith("<!doctype html>")
    found = json.loads(numbers.read_text())
    assert found["plans"]["source_rooms"]["sum"] == 15
    assert found["splits"]["train"]["also_in"] == {"test": 1}
    assert found["distances"]["source_rooms"]["value"] == 0.0
    shown = capsys.readouterr().out
    assert "5 plans" in shown
    assert "Wasserstein-1" in shown


@pytest.mark.browser
@pytest.mark.parametrize("width", [pytest.param(1280, marks=pytest.mark.slow), 390])
def test_nothing_is_wider_than_the_screen(folder: Path, tmp_path: Path, width: int) -> None:
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("Chromium is not installed")
    run(folder, "--out", tmp_path / "report.html", "--compare", folder, "--workers", 1)
    (tmp_path / "frame.html").write_text(
        f'<iframe id="page" src="report.html" style="width:{width}px;height:900px;border:0"></iframe><script>'
        "onload = () => { const d = document.getElementById('page').contentDocument;"
        "document.title = [d.documentElement.scrollWidth, d.querySelectorAll('.plot svg').length,"
        "Math.min(...[...d.querySelectorAll('.plot svg')].map(s => s.getBoundingClientRect().width))]"
        ".join(' ') }</script>"
    )
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"]
    flags += ["--disable-background-networking", "--disable-component-update", "--disable-sync"]
    flags += ["--allow-file-access-from-files", f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=5000"]
    address = (tmp_path / "frame.html").as_uri()
    done = subprocess.run(
        [browser, *flags, "--dump-dom", address], capture_output=True, text=True, check=True, timeout=60
    )
    title = re.search(r"<title>(.*?)</title>", done.stdout)
    assert title is not None, done.stdout[-500:]
    scrolled, plots, narrowest = map(float, title.group(1).split())
    assert scrolled <= width
    assert plots >= 5
    assert narrowest > 250
