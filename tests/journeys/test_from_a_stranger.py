"""Journey 11: an exported data set goes to a stranger, whose folder has traps, by the commands of the page.

The folder has modules with the names of ours and of libraries, links to a secret outside of it, and an archive with a
member that leads out of it.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from houseexpo import export, open_dataset
from pipeline.algorithm import plan_level
from tests.builders.batch import run_build
from tests.journeys.pages import commands

TRAPS = (
    "houseexpo",
    "shapely",
    "numpy",
    "threading",
    "multiprocessing",
    "sitecustomize",
    "pyarrow",
    "PIL",
    "numba",
    "json",
)


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """The stranger's folder: ``homes``, ``homes.zip``, and traps in it and beside it."""
    run_build([Path("procedural:2")], tmp_path / "made", seed=3, plan=plan_level)
    export(open_dataset(tmp_path / "made"), "json", tmp_path / "sent")
    secret = tmp_path / "secret.txt"
    secret.write_text("the secret\n")
    folder = tmp_path / "downloads"
    (folder / "homes").mkdir(parents=True)
    with zipfile.ZipFile(folder / "homes.zip", "w") as archive:
        for file in sorted((tmp_path / "sent").glob("*.json")):
            (folder / "homes" / file.name).write_bytes(file.read_bytes())
            archive.write(file, f"json/{file.name}")
        archive.writestr("../escaped.txt", "out of the folder")
    (folder / "homes" / "mine.txt").symlink_to(secret)
    (folder / "homes" / "splits").mkdir()
    (folder / "homes" / "splits" / "mine.txt").symlink_to(secret)
    for name in TRAPS:
        for place in (folder, folder / "homes"):
            (place / f"{name}.py").write_text(
                f"open({str(tmp_path / 'sprung.txt')!r}, 'a').write('{name} ')\nraise SystemExit(9)\n"
            )
    return folder


@pytest.mark.slow
def test_nothing_of_a_hostile_folder_is_run_or_leads_out_of_it(hostile: Path, tmp_path: Path) -> None:
    program = Path(sys.executable).with_name("houseexpo")
    outside = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if hostile not in file.parents}
    environment = {**os.environ, "HOUSEEXPO_CACHE": str(hostile.parent / "cache")}
    environment.pop("PYTHONPATH", None)
    for command in commands("docs/guide-release.md", "houseexpo validate homes.zip"):
        words = [str(program), *shlex.split(command)[1:]]
        done = subprocess.run(
            words, cwd=hostile, env=environment, capture_output=True, text=True, check=False, timeout=300
        )
        assert not (tmp_path / "sprung.txt").exists(), (command, (tmp_path / "sprung.txt").read_text())
        faults_found = 1 if words[1] == "validate" else 0
        assert done.returncode in {0, faults_found}, (command, done.stderr)
        assert "the secret" not in done.stdout + done.stderr
    written = [file for file in hostile.rglob("*") if file.is_file() and not file.is_symlink()]
    assert not [file for file in written if b"the secret" in file.read_bytes()]
    now = {file: file.stat().st_mtime_ns for file in outside}
    assert now.keys() == outside.keys()
    assert not (tmp_path / "escaped.txt").exists()
    assert (hostile / "report.html").is_file()
    assert len(list((hostile / "maps").glob("*.yaml"))) == len(open_dataset(hostile / "homes")) == 3
