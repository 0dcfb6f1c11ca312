"""Test houses in SUNCG's layout: the same bytes for the same seed, and closed slabs with SUNCG's heights.

``tests/benchmarks/test_bench_quality.py`` compares what the pipeline makes of them with their truth.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.sources import suncg
from pipeline.values import Level
from tests.builders.batch import contents
from tests.builders.suncg_houses import scene_id, write_house, write_houses
from tests.builders.suncg_houses.house import make_house

COUNT, SEED = 20, 2


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("houses")
    write_houses(folder, COUNT, SEED)
    return folder


def test_a_house_is_the_same_whatever_others_are_made(root: Path, tmp_path: Path) -> None:
    write_house(tmp_path, 17, SEED)
    name = scene_id(17, SEED)
    for place in (f"house/{name}", f"room/{name}"):
        assert contents(tmp_path / place) == contents(root / place)


def test_every_level_reads_back_as_it_was_made(root: Path) -> None:
    found = [level for item in suncg.find(str(root)) for level in suncg.read(item)]
    levels = {level.id: level for level in found if isinstance(level, Level)}
    for house in (make_house(index, SEED) for index in range(COUNT)):
        for number, storey in enumerate(house.storeys):
            level = levels.pop(f"{house.id}_L{number}" if number else house.id)
            assert level.room_count == len(storey.cells)
            assert (len(level.walls.faces) > 0) == bool(storey.walls)
            if storey.walls:
                assert (level.frame.floor, level.ceiling_m) == pytest.approx((2.8 * number, 2.73))
            assert {cell.words for cell in storey.cells if cell.words} <= {room.words for room in level.rooms}
    assert not levels
