"""The README's lines of Python run, on a small data set as its lines of shell make one."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from pipeline.algorithm import plan_house
from tests.builders.batch import run_build

README = Path(__file__).resolve().parents[1] / "README.md"
PYTHON = re.findall(r"^```python\n(.*?)^```", README.read_text(), re.DOTALL | re.MULTILINE)


def test_lines_of_python_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_build([Path("procedural:8")], tmp_path / "plans", seed=3, plan=plan_house)
    monkeypatch.chdir(tmp_path)
    assert PYTHON
    for lines in PYTHON:
        names: dict[str, object] = {}
        exec(compile(lines, "README.md", "exec"), names)  # noqa: S102 - our own words
        assert names["free"].shape[0] > 10
        assert names["graph"].number_of_nodes() == len(names["plan"].rooms)
        assert names["reach"].components >= 1
        assert sum(wall.area for wall in names["walls"]) > 0


def test_every_command_that_is_shown_exists() -> None:
    from importlib.metadata import entry_points

    shown = set(re.findall(r"(?:^|&& )houseexpo (\w+)", README.read_text(), re.MULTILINE))
    assert shown <= {entry.name for entry in entry_points(group="houseexpo.commands")}
    assert {"build", "inspect", "export", "stats", "validate"} <= shown
