"""Test houses in SUNCG's layout: the same bytes for the same seed, and each level as it was made.

``tests/benchmarks/test_bench_quality.py`` compares what the pipeline makes of them with their truth.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from pipeline.sources import suncg
from pipeline.values import Level
from tests.builders.batch import contents
from tests.builders.suncg_houses import fault, make_house, scene_id, write_house, write_houses

COUNT, SEED = 10, 2


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("houses")
    write_houses(folder, COUNT, SEED)
    return folder


def test_a_house_is_the_same_whatever_others_are_made(root: Path, tmp_path: Path) -> None:
    write_house(tmp_path, 7, SEED)
    name = scene_id(7, SEED)
    for place in (f"house/{name}", f"room/{name}"):
        assert contents(tmp_path / place) == contents(root / place)


def test_every_level_reads_back_as_it_was_made(root: Path) -> None:
    found = [level for item in suncg.find(str(root)) for level in suncg.read(item)]
    levels = {level.id: level for level in found if isinstance(level, Level)}
    for index in range(COUNT):
        for number, made in enumerate(make_house(index, SEED)):
            level = levels.pop(f"{scene_id(index, SEED)}_L{number}" if number else scene_id(index, SEED))
            assert level.room_count == len(made.storey.cells)
            assert (len(level.walls.faces) > 0) == bool(made.storey.walls)
            if made.storey.walls:
                assert (level.frame.floor, level.ceiling_m) == pytest.approx((2.8 * number, 2.73))
            words = {word for room in level.rooms for word in room.words}
            assert {cell.label for cell in made.storey.cells if cell.label} <= words
    assert not levels


def test_every_hundred_houses_hold_each_fault_in_its_share() -> None:
    planted = [name for index in range(100, 200) for name in fault(index, SEED)]
    assert {name: planted.count(name) for name in ("closed_cell", "open_front", "exact_duplicate")} == {
        "closed_cell": 5,
        "open_front": 4,
        "exact_duplicate": 4,
    }
