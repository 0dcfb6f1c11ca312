"""Damaged files of each format end as levels or as a rejection, whatever its reader meets in them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from pipeline.rejection import Rejection
from pipeline.sources import front3d, gazebo, procthor, roomplan, sweethome
from tests.builders.damage import mutated, outcome
from tests.builders.formats import front3d as scenes
from tests.builders.formats import gazebo as worlds
from tests.builders.formats import procthor as houses
from tests.builders.formats import roomplan as scans
from tests.builders.formats import sweethome as homes
from tests.builders.formats.java_home import java_home


def packed_scan(path: Path) -> bytes:
    pytest.importorskip("pxr")
    return scans.pack(path, {"a.usda": scans.usda(scans.home())}).read_bytes()


AT = "1 1 0.3 0 0 0"
HOME = homes.home(homes.BED)
FILES: dict[str, tuple[str, ModuleType, int, Callable[[Path], bytes]]] = {
    "3D-FRONT": ("scene.json", front3d, 3, lambda _: json.dumps(scenes.scene()).encode()),
    "Gazebo": ("house.world", gazebo, 7, lambda _: worlds.world(worlds.house(), worlds.cube("cart", AT)).encode()),
    "ProcTHOR": ("house.json", procthor, 13, lambda _: json.dumps(houses.house()).encode()),
    "RoomPlan": ("scan.json", roomplan, 11, lambda _: json.dumps(scans.home()).encode()),
    "RoomPlan, packed": ("scan.usdz", roomplan, 11, packed_scan),
    "Sweet Home 3D": ("home.sh3d", sweethome, 5, lambda _: HOME.encode()),
    "Sweet Home 3D, packed": (
        "home.sh3d",
        sweethome,
        5,
        lambda path: homes.write(path, homes.home(homes.BED)).read_bytes(),
    ),
}
"""By format: a name, the reader, a seed, and what a whole file holds."""


@pytest.mark.parametrize("form", FILES)
def test_damaged_files_end_as_levels_or_rejections(tmp_path: Path, form: str) -> None:
    name, reader, seed, made = FILES[form]
    path, refused = tmp_path / name, 0
    data = made(path)
    for changed in mutated(data, 200, seed=seed):
        path.write_bytes(changed)
        item = next(reader.find(str(path)))
        try:
            assert list(reader.read(item))
        except Rejection:
            refused += 1
    assert refused > 20


def test_damaged_older_homes_end_as_levels_or_rejections(tmp_path: Path) -> None:
    for changed in mutated(java_home(HOME), 150, seed=3):
        outcome(homes.write(tmp_path / "old.sh3d", changed, name="Home"))
