"""The report that the data service shows."""

from __future__ import annotations

from pathlib import Path

import pytest

from houseexpo import open_dataset
from stats.live import report_of
from tests.builders.plan_files import houses, pack


def test_it_speaks_of_the_plans_given_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    data = open_dataset(pack(tmp_path, "jsonl", houses(5)))
    html = report_of(data.select(source_rooms=(2, 4)))
    assert html.startswith("<!doctype html>")
    assert "<b>3</b><span>plans" in html
    assert "<script" not in html
