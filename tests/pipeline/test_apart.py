"""No command writes into what it reads: builds, shards, cluster scripts, pictures, releases, splits, training."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import houseexpo
from houseexpo.commands.app import make_app
from houseexpo.errors import ConfigError
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
    """Return commands that write, with a place for that; tests/houseexpo/test_outputs.py tries the others."""
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
