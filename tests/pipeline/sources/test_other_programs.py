"""Files of design programs that are not read: the refusal says how to export them."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from pipeline.sources import find


@pytest.mark.parametrize("name", ["house.blend", "house.FBX", "house.dwg"])
@pytest.mark.parametrize("folder", [False, True])
def test_a_file_of_a_design_program_is_refused_with_how_to_export_it(tmp_path: Path, name: str, folder: bool) -> None:
    (tmp_path / name).write_text("#usda 1.0")
    source = tmp_path if folder else tmp_path / name
    with pytest.raises(ConfigError) as refused:
        list(find(str(source)))
    suffix = Path(name).suffix.lower()
    assert str(refused.value).endswith(f"; export {suffix} as .glb or .ifc from the program that made it")


def test_of_other_files_no_export_is_spoken(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError, match=r"found none of them$"):
        list(find(str(tmp_path / "notes.txt")))
    with pytest.raises(ConfigError, match=r"found nothing of the kind in it$"):
        list(find(str(tmp_path)))


def test_an_archive_is_to_be_unpacked(tmp_path):
    with zipfile.ZipFile(tmp_path / "plans.zip", "w") as packed:
        packed.writestr("house.glb", b"glTF")
    with pytest.raises(ConfigError, match=r"found none of them; unpack \.zip$"):
        list(find(str(tmp_path / "plans.zip")))
