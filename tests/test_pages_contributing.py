"""The pages about adding a source, a stage, a task and an export: followed step by step in a copy of the repository.

R1  A block of Python or text is a new file; the text before it names the file, the last in backticks.
R2  A block marked diff changes the file that was named last: its lines with a space must be there, side by side.
R3  A block without a language holds commands; each must end well.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.algorithm import plan_level
from tests.builders.batch import run_build

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted(
    page for page in (ROOT / "docs" / "contributing").glob("*.md") if page.stem not in {"corpus", "index", "thresholds"}
)
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
NAMED = re.compile(r"`([\w./]+\.(?:py|walls|lines))`")


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the packages and their tests, with a small data set where the pages expect one."""
    for name in ("houseexpo", "pipeline", "stats", "tests", "docs/examples", "data_manifests"):
        shutil.copytree(ROOT / name, tmp_path / "copy" / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copyfile(ROOT / "pyproject.toml", tmp_path / "copy" / "pyproject.toml")
    run_build([Path("procedural:2")], tmp_path / "copy" / "plans" / "demo", seed=3, plan=plan_level)
    return tmp_path / "copy"


def follow(page: str, copy: Path) -> int:
    """Do what a page says; return how many steps there were."""
    named, end, steps = "", 0, 0
    for block in BLOCK.finditer(page):
        named = ([named, *NAMED.findall(page[end : block.start()])])[-1]
        end, steps = block.end(), steps + 1
        language, text = block[1], block[2]
        if language == "diff":
            file = copy / named
            file.write_text(patched(file.read_text(), text))  # R2
        elif language:
            (copy / named).write_text(text)  # R1
        else:
            for line in text.splitlines():
                run(line, copy)  # R3
    return steps


def patched(text: str, diff: str) -> str:
    """Return a text with one change of a diff."""
    lines = diff.splitlines(keepends=True)
    before = "".join(line[1:] for line in lines if line[0] in " -")
    after = "".join(line[1:] for line in lines if line[0] in " +")
    assert text.count(before) == 1, f"expected these lines once:\n{before}"
    return text.replace(before, after)


def run(line: str, copy: Path) -> None:
    words = shlex.split(line, comments=True)
    program = {"houseexpo": [sys.executable, "-m", "houseexpo"], "python": [sys.executable]}[words[0]]
    done = subprocess.run(
        [*program, *words[1:]], cwd=copy, capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(copy)},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_can_be_followed_step_by_step(page: Path, copy: Path) -> None:
    assert follow(page.read_text(), copy) >= 3


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_changes_fit_the_files_as_they_are(page: Path) -> None:
    """The quick half: what a page would change is there."""
    text, named, end = page.read_text(), "", 0
    for block in BLOCK.finditer(text):
        named = ([named, *NAMED.findall(text[end : block.start()])])[-1]
        end = block.end()
        if block[1] == "diff":
            patched((ROOT / named).read_text(), block[2])
        elif block[1] == "python":
            compile(block[2], named, "exec")
