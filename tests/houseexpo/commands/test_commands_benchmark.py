"""``houseexpo benchmark run`` and ``compare`` at the command line."""

from __future__ import annotations

import json
import re
import shutil
from itertools import takewhile
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from houseexpo.commands.app import make_app

RESULTS = Path(__file__).parents[3] / "docs" / "leaderboard"


def called(*words: object) -> Result:
    return CliRunner().invoke(make_app(), ["benchmark", *map(str, words)])


@pytest.mark.slow
def test_a_policy_is_run_and_compared(tmp_path: Path) -> None:
    words = ("run", "--track", "avoidance", "--plans", 2, "--workers", 1)
    for name in ("forward", "random"):
        done = called(*words, "--policy", name, "--out", tmp_path / "new" / f"{name}.json")
        assert done.exit_code == 0, done.output
        assert f"written {tmp_path / 'new' / name}.json" in done.output.replace("\n", "")
    said = json.loads((tmp_path / "new" / "forward.json").read_bytes())
    assert said["track"]["id"] == "avoidance-v2"
    assert len(said["episodes"]["return"]) == 2
    done = called("compare", tmp_path / "new", "--out", tmp_path / "pages" / "page.md")
    assert done.exit_code == 0, done.output
    assert "avoidance-v2: 2 episodes" in done.output
    assert "## avoidance-v2" in (tmp_path / "pages" / "page.md").read_text()


def test_the_table_tells_long_names_apart(tmp_path: Path) -> None:
    """Policies of files are called by their paths, of which a narrow terminal has no room for more than a part."""
    recorded = json.loads(next(RESULTS.glob("avoidance-*forward*.json")).read_bytes())
    names = [f"experiments/of-this-year/{name}.py:policy" for name in ("careful", "daring")]
    for number, name in enumerate(names):
        recorded["policy"]["name"] = name
        (tmp_path / f"{number}.json").write_text(json.dumps(recorded))
    done = called("compare", tmp_path)
    assert done.exit_code == 0, done.output
    first = "".join(re.split(" {2,}", line.strip())[0] for line in done.output.splitlines())
    assert all(name in first for name in names), done.output


def test_a_narrow_table_goes_on_below_and_breaks_no_number(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("bound", "forward", "frontier", "learned-view-10m-0"):
        shutil.copy(RESULTS / f"exploration-budget-v1-{name}.json", tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    done = called("compare", tmp_path)
    assert done.exit_code == 0, done.output
    rows = [row for table in re.split("─ *\n", done.output)[1:] for row in takewhile(str.strip, table.splitlines())]
    assert all(len(row) <= 80 for row in rows)
    cells = [cell for row in rows for cell in re.split(" {2,}", row.strip())[1:]]
    assert cells
    assert all(re.fullmatch(r"-|no|< 0\.001|[-+.\d]+( \[[-+.\d]+, [-+.\d]+\])?", cell) for cell in cells), cells
    for head in ("100 steps", "200 steps", "400 steps", "800 steps", "collisions"):
        assert head in done.output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("run", "--policy", "forward", "--out", "{}/run.txt"), "--out: expected a file that ends in .json"),
        (("run", "--policy", "forwards", "--track", "avoidance", "--out", "{}/a.json"), "did you mean 'forward'"),
        (("run", "--policy", "forward", "--track", "fast", "--out", "{}/a.json"), "--track: expected one of budget"),
        (("run", "--policy", "forward", "--dataset", "{}/none", "--out", "{}/a.json"), "expected a data set, found"),
        (("compare", "{}/none.json"), "none.json: cannot be read"),
        (("compare", "{}", "--out", "{}/page.pdf"), "--out: expected a file that ends in .md"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(words: tuple[str, ...], said: str, tmp_path: Path) -> None:
    done = called(*(word.replace("{}", str(tmp_path)) for word in words))
    assert done.exit_code == 2
    assert said.replace("{}", str(tmp_path)) in done.output
    assert "Traceback" not in done.output
    assert not list(tmp_path.iterdir())


def test_a_policy_that_fails_leaves_no_result(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "def policy(robot, seed):\n    return lambda observation, info: info['steps'] / 0\n"
    )
    done = called(
        "run", "--track", "avoidance", "--plans", 1, "--policy", tmp_path / "mine.py", "--out", tmp_path / "a.json"
    )
    assert done.exit_code == 2
    assert "plan 'room-5.5x3.2', step 0: it raised ZeroDivisionError" in done.output
    assert not (tmp_path / "a.json").exists()
