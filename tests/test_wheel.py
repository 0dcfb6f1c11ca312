"""The wheel, installed in an environment outside the repository, runs the commands."""

from __future__ import annotations

import email
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest

from tests.builders.batch import one_room

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("houseexpo", "pipeline", "stats")


def call(*words: str | Path, cwd: Path) -> str:
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, cwd=cwd, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel from a copy, so that what is built leaves no trace in the repository."""
    folder = tmp_path_factory.mktemp("wheel")
    copy = folder / "source"
    for name in (*PACKAGES, "data_manifests"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet")
    call(*pip, "--no-deps", "--no-build-isolation", "--wheel-dir", folder, copy, cwd=folder)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel: Path) -> Path:
    """Make an environment with nothing but the wheel; what it depends on is borrowed from where the tests run."""
    folder = wheel.parent / "env"
    call(sys.executable, "-m", "venv", "--without-pip", folder, cwd=wheel.parent)
    site = next((folder / ("Lib" if os.name == "nt" else "lib")).rglob("site-packages"))
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", f"--python={folder}", "install")
    call(*pip, "--no-deps", "--no-index", wheel, cwd=wheel.parent)
    borrowed = Path(sysconfig.get_paths()["purelib"])
    kept = [entry for entry in borrowed.iterdir() if "houseexpo" not in entry.name.lower() and entry.suffix != ".pth"]
    for entry in kept:
        if not (site / entry.name).exists():
            (site / entry.name).symlink_to(entry)
    return folder / ("Scripts" if os.name == "nt" else "bin")


@pytest.mark.slow
def test_every_package_and_its_marker_travels(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    modules = {
        file.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for file in (ROOT / package).rglob("*.py")
        if "__pycache__" not in file.parts
    }
    assert modules <= names, sorted(modules - names)
    assert {f"{package}/py.typed" for package in PACKAGES} <= names
    manifests = {f"houseexpo/data_manifests/{name}.toml" for name in ("demo", "houseexpo", "suncg")}
    assert {*manifests, "houseexpo/plan/houseexpo-2.schema.json", "houseexpo/__init__.pyi"} <= names
    assert "houseexpo/release/templates/README.md.j2" in names
    assert not [name for name in names if name.startswith(("tests/", "data_manifests/"))]


@pytest.mark.slow
def test_an_index_page_can_show_what_the_wheel_says_of_itself(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        said = email.message_from_bytes(archive.read(name))
    assert {"Author", "Keywords", "Classifier", "Project-URL", "License-Expression"} <= set(said.keys())
    page = said.get_payload()
    assert page.startswith("# HouseExpo")
    links = re.findall(r"\]\(([^)]+)\)", page)
    assert not [link for link in links if not link.startswith(("https://", "#"))]


@pytest.mark.slow
def test_away_from_a_clone_an_extra_comes_from_the_index(installed: Path, tmp_path: Path) -> None:
    said = call(
        installed / "python",
        "-c",
        "from houseexpo.errors import install_command; print(install_command('serve'))",
        cwd=tmp_path,
    )
    assert said.strip() == "pip install 'houseexpo[serve]'"


@pytest.mark.slow
def test_the_commands_run_outside_the_repository(installed: Path, tmp_path: Path) -> None:
    houses = one_room(tmp_path / "houses" / "villa.ply").parent
    where = call(installed / "python", "-c", "import pipeline; print(pipeline.__file__)", cwd=tmp_path)
    assert str(installed.parent) in where
    assert "build" in call(installed / "houseexpo", "--help", cwd=tmp_path)
    said = call(installed / "houseexpo", "build", houses, "procedural:2", "--out", "built", cwd=tmp_path)
    assert "4 plans from 3 houses" in said
    assert (tmp_path / "built" / "json" / "villa.json").exists()
    assert "0 findings" in call(installed / "houseexpo", "validate", "built", cwd=tmp_path)
    assert "train" in call(installed / "houseexpo", "split", "built", cwd=tmp_path)
    call(installed / "houseexpo", "show", tmp_path / "built" / "json" / "villa.json", "--out", "a.svg", cwd=tmp_path)
    manifest = "from houseexpo.dataset.manifest import load_manifest; print(load_manifest().name)"
    assert "HouseExpo" in call(installed / "python", "-c", manifest, cwd=tmp_path)
    call(installed / "houseexpo", "inspect", houses / "villa.ply", "--out", "seen", cwd=tmp_path)
    assert (tmp_path / "seen" / "stages.png").exists()
    call(installed / "python", "-m", "pipeline", houses, "--out", "again", cwd=tmp_path)


def test_every_package_is_named_in_pyproject() -> None:
    said = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    found = {path.parent.relative_to(ROOT) for name in PACKAGES for path in (ROOT / name).rglob("__init__.py")}
    assert sorted(said) == sorted([".".join(path.parts) for path in found] + ["houseexpo.data_manifests"])
