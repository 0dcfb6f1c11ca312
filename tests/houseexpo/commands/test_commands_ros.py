"""Which houses ``houseexpo ros`` starts with and moves to; the graph itself has tests of its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from houseexpo import FloorPlan
from houseexpo.commands.ros import _Houses
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam import MapHouse

ROOM = FloorPlan("room", [(0, 0), (0, 4), (4, 4), (4, 0)], 1, {})


def save_map(folder: Path, name: str) -> Path:
    """Write a map of map_server: a free square of 2 m with a wall of 0.1 m."""
    cells = np.zeros((42, 42), np.uint8)
    cells[1:-1, 1:-1] = 254
    Image.fromarray(cells).save(folder / f"{name}.pgm")
    file = folder / f"{name}.yaml"
    file.write_text(f"image: {name}.pgm\nresolution: 0.05\norigin: [-1.0, 2.0, 0.0]\n")
    return file


def test_a_map_is_a_house(tmp_path: Path) -> None:
    first = _Houses(save_map(tmp_path, "lab"), None, None).first
    assert isinstance(first, MapHouse)
    assert (first.id, first.pixels_per_metre, first.frame.origin_m) == ("lab", 20.0, (-1.0, 2.0))


def test_a_folder_of_maps_is_a_data_set(tmp_path: Path) -> None:
    for name in ("attic", "lab"):
        save_map(tmp_path, name)
    houses = _Houses(tmp_path, "lab", None)
    assert houses.first.id == "lab"
    assert houses.load("attic").id == "attic"
    with pytest.raises(ConfigError, match="'cellar': expected one of the maps attic, lab"):
        houses.load("cellar")


def test_a_picture_alone_needs_a_resolution(tmp_path: Path) -> None:
    save_map(tmp_path, "lab").unlink()
    with pytest.raises(ConfigError, match="expected the side of a cell"):
        _Houses(tmp_path / "lab.pgm", None, None)
    assert _Houses(tmp_path / "lab.pgm", None, 0.1).first.id == "lab"


def test_one_plan_is_the_only_house(tmp_path: Path) -> None:
    ROOM.save(tmp_path / "room.json")
    houses = _Houses(tmp_path / "room.json", None, None)
    assert houses.first.id == "room"
    with pytest.raises(ConfigError, match="there is only 'room'"):
        houses.load("other")


def test_the_whole_map_is_published_as_it_is() -> None:
    pytest.importorskip("cyclonedds")
    from dataclasses import replace

    from houseexpo.pseudoslam import SimulatorConfig, map_house
    from houseexpo.pseudoslam.ros.fleet import Fleet
    from houseexpo.pseudoslam.ros.node import _whole

    cells = np.ones((30, 40), bool)
    cells[1:20, 1:-1] = False
    house = map_house(cells, 0.1, origin_m=(-1.0, 2.0))
    grid = _whole(Fleet(house, replace(SimulatorConfig(), pixels_per_metre=10.0)))
    assert np.array_equal(grid.data[::-1], np.where(cells, 100, 0))  # row 0 is the lowest
    assert (grid.resolution, tuple(grid.origin)[:2]) == (0.1, (-1.0, 2.0))
