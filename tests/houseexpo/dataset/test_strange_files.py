"""What describes a data set may be anything: a device, a folder, a link to a secret, JSON nested without end."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from houseexpo import open_dataset
from houseexpo.dataset.validation import validate_dataset
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.files import read_file, read_json
from houseexpo.service.build_lists import read_build_lists
from pipeline.batch.verify import find_damaged_files
from tests.builders.services import built, some_plans

DEEP = b'{"files":' + b"[" * 100_000


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return built(tmp_path / "homes", some_plans(), ("a1", "c3"))


def strange(file: Path, how: str) -> None:
    """Replace a file with something that is none, or that says nothing."""
    file.unlink(missing_ok=True)
    make: dict[str, Callable[[], object]] = {
        "folder": file.mkdir,
        "pipe": lambda: os.mkfifo(file),
        "loop": lambda: file.symlink_to(file),
        "device": lambda: file.symlink_to("/dev/zero"),
        "deep": lambda: file.write_bytes(DEEP),
        "bytes": lambda: file.write_bytes(b"\xff\xfe\x00{"),
    }
    make[how]()


HOWS = ("folder", "pipe", "device", "deep", "bytes")


@pytest.mark.parametrize("how", HOWS)
def test_a_strange_manifest_is_said(folder: Path, how: str) -> None:
    strange(folder / "manifest.json", how)
    with pytest.raises(DatasetError, match="expected the manifest of a data set, found"):
        validate_dataset(folder)
    if how in {"deep", "bytes"}:
        assert "manifest.json: damaged" in find_damaged_files(folder)
    else:
        with pytest.raises(ConfigError, match=r"found no manifest.json"):
            next(find_damaged_files(folder))


@pytest.mark.parametrize("how", HOWS)
def test_a_strange_list_of_rejected_inputs_is_said_and_costs_nothing_else(folder: Path, how: str) -> None:
    strange(folder / "rejected.jsonl", how)
    plans = open_dataset(folder)
    if how in {"deep", "bytes"}:
        with pytest.raises(DatasetError, match="expected a rejected input a line"):
            plans.rejected  # noqa: B018
    else:
        assert plans.rejected == []
    found = read_build_lists(folder)
    assert not found.refused
    assert found.broken


def test_a_link_to_a_text_of_this_machine_is_no_list(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("a1\nthe word\nof the day\n/etc/passwd\n")
    (folder / "splits" / "val.txt").symlink_to(tmp_path / "secret")
    assert set(open_dataset(folder).splits) == {"train"}


def test_a_manifest_that_names_a_device_is_verified_to_the_end(folder: Path) -> None:
    files = {"../../../../../../../dev/zero": "0" * 64, "/dev/zero": "0" * 64}
    (folder / "manifest.json").write_bytes(msgspec.json.encode({"files": files}))
    assert {line for line in find_damaged_files(folder) if "zero" in line} == {f"{name}: missing" for name in files}


def test_files_are_read_up_to_a_size(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"[1]")
    assert read_file(tmp_path / "a", 3) == b"[1]"
    assert read_json(tmp_path / "a", list[int]) == [1]
    with pytest.raises(OSError, match="expected at most"):
        read_file(tmp_path / "a", 2)
    with pytest.raises(FileNotFoundError):
        read_file(tmp_path / "b")
