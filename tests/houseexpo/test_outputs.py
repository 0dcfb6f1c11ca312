"""Where commands write: never into what they read, and never over a file of somebody else unasked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import houseexpo
from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError
from houseexpo.outputs import CommandOutput
from tests.builders.batch import one_room, run_build


@pytest.fixture
def homes(tmp_path: Path) -> Path:
    one_room(tmp_path / "houses" / "a.ply")
    one_room(tmp_path / "houses" / "b.ply", 6.0)
    run_build([tmp_path / "houses"], tmp_path / "homes")
    return tmp_path / "homes"


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def houseexpo_(*words: str | Path) -> Result:
    return CliRunner().invoke(make_app(), [str(word) for word in words])


@pytest.mark.parametrize("place", ["", "json", "json/", "new/folder", "../homes", "link"])
def test_nothing_is_written_into_the_data_set_that_is_read(homes: Path, place: str) -> None:
    before = files_of(homes)
    (homes.parent / "link").symlink_to(homes / "json", target_is_directory=True)
    out = homes.parent / "link" if place == "link" else f"{homes}/{place}"
    for words in (["export", homes, "--to", "json", "--out", out, "--replace"],
                  ["stats", homes, "--out", f"{out}/report.html", "--replace"],
                  ["show", homes, "--out", f"{out}/sheet.png", "--replace"]):  # fmt: skip
        done = houseexpo_(*words)
        assert done.exit_code != 0
        assert "which is read" in done.output.replace("\n", "")
        assert files_of(homes) == before


def test_the_plan_that_is_read_is_not_written_over(homes: Path) -> None:
    file = homes.parent / "plan.svg"
    file.write_bytes((homes / "json" / "a.json").read_bytes())
    with pytest.raises(ConfigError, match="which is read"), CommandOutput(file, [file], replace=True):
        pass


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda homes, out: ["export", homes, "--to", "svg", "--out", out], "a.svg"),
        (lambda homes, out: ["show", homes, "--out", out / "sheet.png"], "sheet.png"),
        pytest.param(
            lambda homes, out: ["stats", homes, "--out", out / "report.html"], "report.html", marks=pytest.mark.slow
        ),
        (lambda homes, out: ["stats", homes, "--out", out / "report.json"], "report.json"),
        pytest.param(
            lambda homes, out: ["inspect", homes.parent / "houses" / "a.ply", "--out", out],
            "stages.png",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_a_file_of_somebody_else_stays_unless_replace_says_otherwise(
    homes: Path, tmp_path: Path, make: Callable[[Path, Path], list[str | Path]], name: str
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_text("mine")
    words = make(homes, out)
    refused = houseexpo_(*words)
    assert refused.exit_code == 2
    assert f"{out / name}: a file is there already" in refused.output.replace("\n", "")
    assert (out / name).read_text() == "mine"
    assert houseexpo_(*words, "--replace").exit_code == 0
    ours = (out / name).read_bytes()
    assert ours != b"mine"
    assert houseexpo_(*words).exit_code == 0  # it is ours now
    (out / name).write_text("edited")
    assert houseexpo_(*words).exit_code != 0
    assert (out / name).read_text() == "edited"


def test_a_link_is_not_followed_and_not_lost(homes: Path, tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "a.svg").symlink_to(tmp_path / "precious")
    plans = houseexpo.open_dataset(homes)
    with pytest.raises(ConfigError, match="--replace"):
        houseexpo.export(plans, "svg", tmp_path / "out")
    houseexpo.export(plans, "svg", tmp_path / "out", replace=True)
    assert (tmp_path / "precious").read_text() == "mine"
    assert (tmp_path / "out" / "a.svg").read_bytes().startswith(b"<svg")


def test_the_report_of_a_build_may_lie_in_its_build_folder(homes: Path) -> None:
    assert houseexpo_("stats", homes, "--out", homes / ".build" / "statistics.html").exit_code == 0
    assert houseexpo_("stats", homes, "--out", homes / ".build" / "statistics.html").exit_code == 0


def test_without_notes_a_file_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "cache").write_text("no folder")
    monkeypatch.setenv("HOUSEEXPO_CACHE", str(tmp_path / "cache"))
    for _ in range(2):  # equal bytes are left as they are
        with CommandOutput(tmp_path / "out", folder=True) as output:
            output.write(tmp_path / "out" / "a.txt", b"a")
    with pytest.raises(ConfigError, match="--replace"), CommandOutput(tmp_path / "out", folder=True) as output:
        output.write(tmp_path / "out" / "a.txt", b"b")


def test_runs_go_into_folders_of_their_own(homes: Path) -> None:
    before = files_of(homes)
    assert houseexpo_("train", "avoidance", "--out", homes, "--dataset", homes).exit_code == 2
    mine = homes.parent / "mine"
    mine.mkdir()
    (mine / "manifest.json").write_text("mine")
    done = houseexpo_("observe", homes, "--out", mine)
    assert "expected an empty folder or a former run, found manifest.json" in done.output.replace("\n", " ")
    assert files_of(mine) == {"manifest.json": b"mine"}
    assert files_of(homes) == before
