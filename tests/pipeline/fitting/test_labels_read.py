"""Files of labels: what ``houseexpo labels`` writes is read, in the order of ids, and anything else is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest

from houseexpo.errors import ConfigError
from pipeline.config_file import BuildConfig
from pipeline.fitting.labels import read_labels
from pipeline.fitting.rows import rows_of_houses
from pipeline.sources import reader
from pipeline.values import Input

PLACES: dict[str, Any] = {"rooms": [], "unlike": [], "no_rooms": [], "ways": [], "no_ways": [[1.0, 2.0]]}


def line(name: str, **values: Any) -> bytes:
    """A line of labels, with the values that matter."""
    given = {"file": name, "level": 0, "extent": [8, 6], **PLACES, "path": f"/{name}.glb", "reader": "mesh_file"}
    return msgspec.json.encode(given | values) + b"\n"


def test_storeys_are_gathered_by_their_input(tmp_path: Path) -> None:
    file = tmp_path / "labels.jsonl"
    options = {"up": "z", "scale": "2.0"}
    file.write_bytes(line("b", options=options) + line("a") + b"\n" + line("b", level=1, options=options))
    found = read_labels(file)
    assert list(found) == [
        Input("a", "mesh_file", "/a.glb"),
        Input("b", "mesh_file", "/b.glb", options=(("scale", "2.0"), ("up", "z"))),
    ]
    assert [[each.level for each in storeys] for storeys in found.values()] == [[0], [0, 1]]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"[door]\n", "line 1: expected labels of a storey, found something else"),
        (line("a") + b"{\n", "line 2: expected labels of a storey"),
        (line("a", moon=1), "unknown field `moon`"),
        (line("a", ways=[[1.0]]), "line 1: expected labels of a storey"),
        (line("a").replace(b"1.0", b"NaN"), "line 1: expected labels of a storey"),
        (line("a").replace(b"1.0", b"1e999"), "line 1: "),
        (line("a", path=""), "line 1: expected the file that they are of, found none; write them again"),
        (line("a", reader=""), "line 1: expected the file that they are of, found none; write them again"),
        (b"\xff\xfe\n", "line 1: expected labels of a storey"),
    ],
)
def test_what_is_no_label_is_refused_by_its_line(tmp_path: Path, data: bytes, words: str) -> None:
    file = tmp_path / "labels.jsonl"
    file.write_bytes(data)
    with pytest.raises(ConfigError) as caught:
        read_labels(file)
    assert words in str(caught.value)
    assert str(file) in str(caught.value)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"none\.jsonl: cannot be read .*; check the path"):
        read_labels(tmp_path / "none.jsonl")


@pytest.mark.slow
def test_a_house_that_is_gone_or_cannot_be_read_is_told(tmp_path: Path) -> None:
    file = tmp_path / "labels.jsonl"
    (tmp_path / "b.glb").write_bytes(b"no mesh")
    file.write_bytes(line("a", path=str(tmp_path / "a.glb")) + line("b", path=str(tmp_path / "b.glb")))
    rows, left_out = rows_of_houses(read_labels(file), BuildConfig(), workers=1)
    assert rows == []
    assert [sentence[:3] for sentence in left_out] == ["a: ", "b: "]


@pytest.mark.parametrize("name", ["mesh_flie", "files", "mesh_file.nothing", ""])
def test_a_reader_that_this_version_lacks_is_told_in_a_sentence(name: str) -> None:
    with pytest.raises(ConfigError, match=rf"reader '{name}': this version has no such reader"):
        reader(name)
    assert reader("reader_choice")  # lists files, and has them read by others
