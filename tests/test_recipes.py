"""The commands of the README and of the pages for readers, run as they are printed, in a folder like a reader's."""

from __future__ import annotations

import re
import shlex
import shutil
import tarfile
from pathlib import Path

import pytest
from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.dataset import open_dataset
from houseexpo.exports import export
from pipeline.algorithm import plan_level
from tests.builders.batch import run_build
from tests.builders.examples import FOLDER
from tests.journeys.pages import blocks

ROOT = Path(__file__).resolve().parents[1]
PAGES = [
    *sorted(page for page in (ROOT / "docs" / "readers").glob("*.md") if page.stem != "analysis"),
    ROOT / "docs" / "guide-library.md",
    ROOT / "docs" / "guide-statistics.md",
]
NOT_RUN = {
    "fetch": "needs the network",
    "houseexpo demo": "the folder holds what it writes",
    "cd ": "as above",
    "houseexpo play": "needs a person at a terminal",
    "houseexpo serve": "runs until Ctrl-C",
    "houseexpo review": "runs until Ctrl-C",
    "procedural:1000": "takes minutes",
    "/shared/": "needs a cluster",
    "s3://": "needs an object store",
    "some_id": "stands for an id of the reader's",
}
"""What is shown and not run, and why; tests of their own run all but the first four on a small scale."""


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with what the recipes name: a demo data set, a published archive, houses."""
    monkeypatch.chdir(tmp_path)
    run_build([Path("procedural:6")], tmp_path / "plans" / "demo", seed=3, plan=plan_level)
    shutil.copytree(FOLDER, tmp_path, dirs_exist_ok=True)
    plans = open_dataset(tmp_path / "plans" / "demo")
    files = export(plans, "json", tmp_path / "published")
    shutil.copyfile(files[0], tmp_path / "a_plan.json")
    with tarfile.open(tmp_path / "json.tar.gz", "w:gz") as archive:
        for file in files:
            archive.add(file, f"json/{file.name}")
    (tmp_path / "bad.txt").write_text(f"{plans.ids[0]}\n")
    shutil.copytree(tmp_path / "plans" / "demo", tmp_path / "plans" / "homes")
    return tmp_path


def recipes(page: Path) -> list[str]:
    """The commands of a page, comments left out."""
    lines = [line for block in blocks(page, "") for line in block.splitlines() if line.startswith("houseexpo ")]
    return [part.strip() for line in lines for part in re.sub(r"\s+#.*", "", line).split("&&")]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_recipes_run_as_they_are_printed(page: Path, place: Path) -> None:
    ran = 0
    built = ""
    for recipe in recipes(page):
        if any(part in recipe for part in NOT_RUN):
            continue
        words = shlex.split(recipe)
        if words[1] == "build" and words[2] != built:  # the recipes of a page are alternatives
            shutil.rmtree(place / words[words.index("--out") + 1], ignore_errors=True)
            built = words[2]
        target = words[words.index(">") + 1] if ">" in words else ""
        words = words[1 : words.index(">")] if target else words[1:]
        done = CliRunner().invoke(make_app(), words)
        assert done.exit_code == 0, f"{recipe}\n{done.output}"
        if target:
            (place / target).write_text(done.stdout)
        ran += 1
    assert ran
