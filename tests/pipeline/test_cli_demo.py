"""``houseexpo demo``: what it writes can be built, and what is there already stays."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from houseexpo.commands.app import make_app
from houseexpo.dataset import open_dataset


def demo(*words: str | Path) -> tuple[int, str]:
    done = CliRunner().invoke(make_app(), ["demo", *map(str, words), "--workers", "1"])
    return done.exit_code, done.output


def test_it_writes_houses_and_plans_and_names_the_next_command(tmp_path: Path) -> None:
    code, said = demo(tmp_path / "try", "--plans", "2")
    assert code == 0, said
    assert {file.name for file in (tmp_path / "try").iterdir()} == {
        *("house.glb", "house.ifc", "houses", "houses.toml", "corrections.toml", "plans"),
    }
    assert len(open_dataset(tmp_path / "try" / "plans" / "demo")) == 2
    assert f"cd {tmp_path / 'try'} && houseexpo build house.glb --out plans/house" in said
    assert demo(tmp_path / "try", "--plans", "2")[0] == 0  # again: nothing is built or asked


def test_files_of_others_stay(tmp_path: Path) -> None:
    (tmp_path / "house.glb").write_text("mine")
    code, said = demo(tmp_path, "--plans", "0")
    assert code == 2
    assert "house.glb: a file is there already" in said.replace("\n", "")
    assert [file.name for file in tmp_path.iterdir()] == ["house.glb"]
    assert demo(tmp_path, "--plans", "0", "--replace")[0] == 0
    assert (tmp_path / "house.glb").read_bytes() != b"mine"
