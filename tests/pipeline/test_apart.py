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
def houses(tmp_path: Path) -> Path:
    one_room(tmp_path / "houses" / "a.ply")
    one_room(tmp_path / "houses" / "deep" / "b.ply", 6.0)
    return tmp_path / "houses"


def files_of(folder: Path) -> dict[str, bytes]:
    return {str(file.relative_to(folder)): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def houseexpo_(*words: str | Path) -> Result:
    return CliRunner().invoke(make_app(), [str(word) for word in words])


def test_a_build_into_its_own_source_is_refused(houses: Path) -> None:
    before = files_of(houses)
    (houses.parent / "link").symlink_to(houses, target_is_directory=True)
    (houses / "houses.toml").write_text('[build]\nsources = ["."]\n')
    for source, out in (
        ([houses], houses / "out"),
        ([houses], houses),
        ([houses / "deep"], houses / "deep" / "x" / "y"),
        ([houses], houses.parent / "link" / "out"),
        ([houses.parent / "link"], houses / "out"),
        ([houses / "a.ply", houses / "deep"], houses / "deep" / "out"),
        (["--config", houses / "houses.toml"], houses / "out"),
    ):
        for shard in ([], ["--shard", "0/2"], ["--replace"]):
            done = houseexpo_("build", *source, "--out", out, *shard)
            assert done.exit_code == 2, done.output
            assert "which is read and never written into" in " ".join(done.output.split())
    (houses / "houses.toml").unlink()
    assert files_of(houses) == before


def test_python_and_scripts_for_a_cluster_refuse_it_too(houses: Path) -> None:
    with pytest.raises(ConfigError, match="never written into"):
        houseexpo.build(houses, houses / "out")
    (houses.parent / "houses.toml").write_text('[build]\nsources = ["houses"]\n')
    words = ["slurm", houses.parent / "houses.toml", "--shards", "2", "--out", houses / "out"]
    assert "never written into" in " ".join(houseexpo_(*words).output.split())
    assert not (houses / "out").exists()


def test_a_source_among_the_plans_of_the_folder_is_refused(houses: Path, tmp_path: Path) -> None:
    plans = tmp_path / "plans"
    run_build([houses], plans)
    one_room(plans / "json" / "mine.ply")
    before = files_of(plans)
    for source in (plans / "json", plans / "json" / "mine.ply"):
        done = houseexpo_("build", source, "--out", plans, "--replace")
        assert done.exit_code == 2
        assert "where a build writes" in " ".join(done.output.split())
        assert files_of(plans) == before


def writing(homes: Path, houses: Path, out: Path) -> list[list[str | Path]]:
    """Return commands that write, with a place for that."""
    return [
        ["split", homes, "--out", out],
        ["release", homes, "--out", out],
        ["train", "chooser", homes, "--out", out],
        ["observe", homes, "--out", out],
        ["benchmark", "run", "--dataset", homes, "--policy", "random", "--out", f"{out}.json"],
        ["benchmark", "team", "--dataset", homes, "--out", f"{out}.md"],
        ["record", homes, "--out", f"{out}.gif"],
        ["record", homes, "--bag", f"{out}.mcap"],
        ["inspect", houses, "--out", houses / out.name],
    ]


def test_commands_that_write_keep_out_of_their_input(houses: Path) -> None:
    homes = houses.parent / "homes"
    run_build([houses], homes)
    before = files_of(houses.parent)
    for place in (homes / "json" / "new", homes / "new"):
        for words in writing(homes, houses, place):
            done = houseexpo_(*words)
            assert done.exit_code == 2, words
            assert "which is read" in " ".join(done.output.split()), words
            assert files_of(houses.parent) == before, words


def test_a_run_keeps_out_of_the_data_set_that_its_file_names(houses: Path) -> None:
    pytest.importorskip("torch")
    homes = houses.parent / "homes"
    run_build([houses], homes)
    (houses.parent / "train.toml").write_text(f'[environment]\ndataset = "{homes}"\n')
    done = houseexpo_("train", "exploration", "--config", houses.parent / "train.toml", "--out", homes / "run")
    assert "which is read" in " ".join(done.output.split())
    assert not (homes / "run").exists()


def test_a_split_leaves_lists_of_others_alone(houses: Path) -> None:
    homes = houses.parent / "homes"
    run_build([houses], homes)
    home = homes / "splits"
    home.mkdir()
    (home / "mine.txt").write_text("a\n")
    (home / "train.txt").write_text("z\n")
    refused = houseexpo_("split", homes)
    assert refused.exit_code == 2
    assert "a list is there already that no split wrote" in " ".join(refused.output.split())
    assert files_of(home) == {"mine.txt": b"a\n", "train.txt": b"z\n"}
    assert houseexpo_("split", homes, "--replace", "--paper").exit_code == 0
    assert set(files_of(home)) == {"mine.txt", "train.txt", "test.txt", "splits.json"}
    (home / "test.txt").write_text("b\n")
    assert houseexpo_("split", homes, "--train", "1", "--test", "0").exit_code == 0  # its own lists are replaced
    assert set(files_of(home)) == {"mine.txt", "train.txt", "test.txt", "splits.json"}  # a changed one is not


def test_tables_of_teams_are_refused_before_the_work_if_their_numbers_cannot_be_written(houses: Path) -> None:
    (houses.parent / "teams.json").write_text("mine")
    words = ["benchmark", "team", "--dataset", houses, "--out", houses.parent / "teams.md"]
    assert "a file is there already" in " ".join(houseexpo_(*words).output.split())


@pytest.fixture
def homes(tmp_path: Path) -> Path:
    one_room(tmp_path / "houses" / "a.ply")
    one_room(tmp_path / "houses" / "b.ply", 6.0)
    run_build([tmp_path / "houses"], tmp_path / "homes")
    return tmp_path / "homes"


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
    assert houseexpo_("train", "avoidance", "--out", homes, homes).exit_code == 2
    mine = homes.parent / "mine"
    mine.mkdir()
    (mine / "manifest.json").write_text("mine")
    done = houseexpo_("observe", homes, "--out", mine)
    assert "expected an empty folder or a former run, found manifest.json" in done.output.replace("\n", " ")
    assert files_of(mine) == {"manifest.json": b"mine"}
    assert files_of(homes) == before
