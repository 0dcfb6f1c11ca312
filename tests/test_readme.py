"""The lines of the README and of the other pages: Python runs, commands and options exist, links lead somewhere."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import typer

from houseexpo.commands.app import make_app
from houseexpo.dataset import open_dataset
from houseexpo.dataset.splits import split_plans, write_split
from houseexpo.pseudoslam.benchmark.collection import CollectSettings, collect_episodes
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.release import release
from pipeline.algorithm import plan_level
from tests.builders.batch import run_build
from tests.builders.needs import need
from tests.builders.services import running, service_of
from tests.journeys.pages import blocks

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
PAGES = [
    README,
    ROOT / "CONTRIBUTING.md",
    ROOT / "SECURITY.md",
    *sorted(page for page in (ROOT / "docs").rglob("*.md") if "_build" not in page.parts),
]
NAMES = {page: page.relative_to(ROOT).with_suffix("").as_posix() for page in PAGES}
MAX_CHARACTERS = 8000
CONTINUED = {ROOT / "docs" / "readers" / "analysis.md"}
"""Pages whose blocks of Python continue each other."""


def python_of(page: Path) -> list[str]:
    """The blocks of Python of a page; one where they continue each other."""
    found = blocks(page, "python")
    return ["\n".join(found)] if page in CONTINUED else found


PYTHON = {  # by the lines, so that what two pages show runs once
    lines: f"{NAMES[page]}-{number}"
    for page in PAGES
    if page.parent.name != "contributing"  # files, which tests/test_pages_contributing.py writes and runs
    for number, lines in enumerate(python_of(page))
}

INSTALLED_BY = {
    "torch": "make learn",
    "stable_baselines3": "make learn",
    "sb3_contrib": "make learn",
    "geopandas": "make readers",
    "datasets": "make readers",
    "minari": "make learn",
}
PUFFER = Path(sys.prefix) / "puffer"
OWN_PROCESS = {"torchrl": ["torchrl"], "ray": ["ray", "tree"], "pufferlib": []}
"""Libraries that change their process, by name, and the modules that their lines need."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that holds the data set that the lines open, and its release."""
    found = tmp_path_factory.mktemp("readme")
    demo = found / "plans" / "demo"
    run_build([Path("procedural:8")], demo, seed=3, plan=plan_level)
    plans = open_dataset(demo)
    write_split(split_plans(plans, {"train": 0.7, "val": 0.1, "test": 0.2}, 0, 1), demo)
    release(demo, found / "releases" / "demo")
    return found


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    """Where the data set is served."""
    with running(service_of(folder / "plans" / "demo")) as found:
        yield f"{found}/demo"


@pytest.mark.slow
@pytest.mark.parametrize("lines", PYTHON, ids=PYTHON.get)
def test_lines_of_python_run(lines: str, folder: Path, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for module, how in INSTALLED_BY.items():
        if re.search(rf"^(import|from) {module}\b", lines, re.MULTILINE) or f"to_{module}" in lines:
            need(modules=[module], how=how)
    for module, needed in OWN_PROCESS.items():
        if re.search(rf"^(import|from) {module}\b", lines, re.MULTILINE):
            run_alone(lines, folder, needed)
            return
    monkeypatch.chdir(folder)
    monkeypatch.setenv("HF_HOME", str(folder / "cache"))
    if "import minari" in lines:
        monkeypatch.setenv("MINARI_DATASETS_PATH", "")  # the lines set it
        plans, out = open_dataset(folder / "plans" / "demo"), folder / "collected" / "frontier-v0"
        out.parent.mkdir(exist_ok=True)
        collect_episodes(find_track("budget"), "frontier", plans, out, CollectSettings(episodes=2))
    lines = lines.replace("http://127.0.0.1:8000/demo", address)
    names: dict[str, object] = {}
    exec(compile(lines, "a page", "exec"), names)  # noqa: S102 - our own words
    if "reach" in names:
        assert names["occupied"].shape[0] > 10
        assert names["graph"].number_of_nodes() == len(names["plan"].rooms)
        assert names["reach"].components >= 1
        assert sum(wall.area for wall in names["walls"]) > 0
    if "info" in names:
        assert np.all(np.asarray(names["info"]["explored_m2"]) > 0)
    if "grid" in names:
        assert set(np.unique(names["grid"].data)) == {-1, 0, 100}


def run_alone(lines: str, folder: Path, needed: list[str]) -> None:
    """Run lines as a program of their own, beside PufferLib."""
    if needed:
        need(modules=needed, how="make clients")
    else:
        need(folders=[PUFFER / "pufferlib"], how="make puffer")
    program = folder / "alone.py"
    program.write_text(lines)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *([] if needed else [str(PUFFER)])])}
    environment["RAY_ADDRESS"] = "local"  # and not a cluster that another test left
    done = subprocess.run(
        [sys.executable, program.name], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-4000:]
    assert done.stdout.strip()


def _commands(text: str) -> list[list[str]]:
    """The words of each ``houseexpo`` command that a page shows on a line of its own."""
    lines = re.findall(r"^(?: {4})?(houseexpo [^#\n]+)", text.replace("\\\n", " "), re.MULTILINE)
    return [shlex.split(command) for line in lines for command in line.split("&&") if "houseexpo" in command]


@pytest.fixture(scope="module")
def options_of() -> Callable[[str, str], set[str]]:
    """The options of a command, by its name and the word after it, which names one of a command's own."""
    group = typer.main.get_command(make_app())
    assert isinstance(group, typer.core.TyperGroup)

    @cache
    def options(name: str, word: str) -> set[str]:
        command = group.get_command(None, name)  # type: ignore[arg-type]
        if hasattr(command, "get_command"):
            command = command.get_command(None, word)
        return {option for parameter in command.params for option in [*parameter.opts, *parameter.secondary_opts]}

    return options


@pytest.mark.parametrize("page", PAGES, ids=NAMES.get)
def test_every_command_and_option_that_is_shown_exists(page: Path, options_of: Callable[[str, str], set[str]]) -> None:
    for _, name, *words in _commands(page.read_text()):
        known = options_of(name, words[0] if words else "")
        assert {word for word in words if word.startswith("--")} <= known, (name, words)


def test_the_readme_is_short() -> None:
    assert len(README.read_text()) <= MAX_CHARACTERS


@pytest.mark.parametrize("page", PAGES, ids=NAMES.get)
def test_links_to_files_and_headings_lead_there(page: Path) -> None:
    for place, heading in re.findall(r"\]\(([^)#:]*)(?:#([^)]*))?\)", page.read_text()):
        target = page.parent / place if place else page
        assert target.is_file(), place
        if heading:
            headings = re.findall(r"^#+ (.*)$", target.read_text(), re.MULTILINE)
            slugs = {re.sub(r"[^\w -]", "", each).lower().replace(" ", "-") for each in headings}
            assert heading in slugs, (place, heading)
