"""Files that people name to commands: devices, pipes, folders, nesting and aliases without end are said in words."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from houseexpo.commands.arguments import parse_ids
from houseexpo.configuration import read_toml
from houseexpo.errors import ConfigError, PlanError, TrainingError
from houseexpo.floorplan import load_plan
from houseexpo.inference.map_prediction import read_network
from houseexpo.pseudoslam import SimulatorConfig
from houseexpo.pseudoslam.benchmark.result import read_result
from houseexpo.pseudoslam.learning.weights import read_weights
from pipeline.overrides import load_overrides


def trained(file: Path) -> Any:
    pytest.importorskip("torch")
    from houseexpo.pseudoslam.learning.policy_file import read_policy

    return read_policy(file)


READERS: list[Callable[[Path], Any]] = [
    read_toml, SimulatorConfig.from_yaml, read_result, read_weights, trained,
    lambda file: parse_ids([f"@{file}"]),
    lambda file: load_overrides(None, file), read_network,
]  # fmt: skip
NESTED = b"[" * 100_000


@pytest.mark.parametrize("how", ["device", "pipe", "folder", "circle", "nested", "bytes"])
@pytest.mark.parametrize("read", READERS)
def test_what_cannot_be_read_is_said(tmp_path: Path, read: Callable[[Path], Any], how: str) -> None:
    file = tmp_path / "file"
    make: dict[str, Callable[[], object]] = {
        "device": lambda: file.symlink_to("/dev/zero"),
        "pipe": lambda: os.mkfifo(file),
        "folder": file.mkdir,
        "circle": lambda: file.symlink_to(file),
        "nested": lambda: file.write_bytes(NESTED),
        "bytes": lambda: file.write_bytes(b"\xff\xfe\x00["),
    }
    make[how]()
    if how == "nested" and read in READERS[5:6]:
        return  # a list of ids may hold any word
    with pytest.raises((ConfigError, TrainingError), match="file"):
        read(file)


def test_a_folder_is_no_plan(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"found a folder; houseexpo\.open_dataset opens it"):
        load_plan(tmp_path)
    with pytest.raises(PlanError, match="expected the path of a file, found one with a null character"):
        load_plan("plan\0.json")


def test_aliases_do_not_make_a_small_file_large(tmp_path: Path) -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]
    (tmp_path / "config.yaml").write_text("\n".join([*lines, "robot: *a8", "pixels_per_metre: *a8"]))
    with pytest.raises(ConfigError, match="alias") as error:
        SimulatorConfig.from_yaml(tmp_path / "config.yaml")
    assert len(str(error.value)) < 500
