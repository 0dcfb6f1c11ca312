"""The README's lines of Python run, on a small data set as its lines of shell make one."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.algorithm import plan_level
from tests.builders.batch import run_build

README = Path(__file__).resolve().parents[1] / "README.md"
PYTHON = re.findall(r"^```python\n(.*?)^```", README.read_text(), re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds the data set that the lines open."""
    found = tmp_path_factory.mktemp("readme")
    run_build([Path("procedural:8")], found / "plans", seed=3, plan=plan_level)
    return found


@pytest.mark.parametrize("lines", PYTHON)
def test_lines_of_python_run(lines: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if "stable_baselines3" in lines:
        pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is no dependency of this project")
    monkeypatch.chdir(folder)
    names: dict[str, object] = {}
    exec(compile(lines, "README.md", "exec"), names)  # noqa: S102 - our own words
    if "graph" in names:
        assert names["free"].shape[0] > 10
        assert names["graph"].number_of_nodes() == len(names["plan"].rooms)
        assert names["reach"].components >= 1
        assert sum(wall.area for wall in names["walls"]) > 0
    if "info" in names:
        assert np.all(np.asarray(names["info"]["explored_m2"]) > 1)
    if "grid" in names:
        assert set(np.unique(names["grid"].data)) == {-1, 0, 100}


def test_every_command_that_is_shown_exists() -> None:
    from importlib.metadata import entry_points

    shown = set(re.findall(r"(?:^|&& )houseexpo (\w+)", README.read_text(), re.MULTILINE))
    assert shown <= {entry.name for entry in entry_points(group="houseexpo.commands")}
    assert {"build", "inspect", "export", "stats", "validate"} <= shown
