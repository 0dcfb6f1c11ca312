"""Files of design programs that are not read: the refusal says how to export them."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from houseexpo.errors import ConfigError
from pipeline.sources import find


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("house.blend", ".glb"),
        ("house.FBX", ".glb"),
        ("house.dwg", ".dxf"),
        ("h.rvt", ".ifc"),
        ("h.skp", ".glb or .ifc"),
    ],
)
@pytest.mark.parametrize("folder", [False, True])
def test_a_file_of_a_design_program_is_refused_with_how_to_export_it(
    tmp_path: Path, name: str, form: str, folder: bool
) -> None:
    (tmp_path / name).write_bytes(b"\x00design")
    source = tmp_path if folder else tmp_path / name
    with pytest.raises(ConfigError) as refused:
        list(find(str(source)))
    suffix = Path(name).suffix.lower()
    assert str(refused.value).endswith(f"; export {suffix} as {form} from the program that made it")
    assert len(str(refused.value)) < 120 + len(str(source))  # no list of all formats


def test_of_other_files_the_formats_are_listed(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"the folder is empty$"):
        list(find(str(tmp_path)))
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError, match=r"cannot read this file; it reads meshes \(.*procedural:COUNT$"):
        list(find(str(tmp_path / "notes.txt")))
    with pytest.raises(ConfigError, match=r"no file in it is a house that houseexpo can read; it reads meshes"):
        list(find(str(tmp_path)))


@pytest.mark.parametrize(
    ("name", "content"), [("a.pdf", "%PDF-1.4"), ("a.svg", "<svg xmlns='http://www.w3.org/2000/svg'/>")]
)
def test_a_drawing_that_is_no_plan_is_to_be_exported_as_dxf(tmp_path: Path, name: str, content: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(ConfigError, match=r"cannot read this file; .*export .*drawings? as \.dxf"):
        list(find(str(tmp_path / name)))


def test_an_archive_is_to_be_unpacked(tmp_path):
    with zipfile.ZipFile(tmp_path / "plans.zip", "w") as packed:
        packed.writestr("house.glb", b"glTF")
    with pytest.raises(ConfigError, match=r"cannot read this file; unpack \.zip$"):
        list(find(str(tmp_path / "plans.zip")))
