"""Test houses in SUNCG's layout: the same bytes for the same seed, and closed slabs with SUNCG's heights.

``tests/benchmarks/test_bench_quality.py`` compares what the pipeline makes of them with their truth.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from pipeline.sources import suncg
from pipeline.sources.meshes import obj
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


def test_slabs_are_closed_and_as_thick_and_high_as_suncgs(root: Path) -> None:
    for path in sorted(root.glob("room/*/*w.obj"))[:20]:
        mesh = obj.parse_plain_obj(path.read_bytes(), path.name)
        names = re.findall(r"^o Wall(?:Inside|Outside)#(\S+)$", path.read_text(), re.MULTILINE)
        slabs = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).split(only_watertight=False)
        assert len(slabs) == len(names) == 2 * len(set(names))
        for slab in slabs:
            assert slab.is_watertight
            assert slab.volume > 0
            heights = np.unique(slab.vertices[:, 1].round(6)) % 2.8
            known = [0.0, 0.04, 0.87, 2.12, 2.23, 2.73]
            assert all(np.abs(height - np.array(known)).min() < 1e-5 for height in heights)
            normal = slab.face_normals[np.argmax(slab.area_faces)]  # a slab's largest faces are its sides
            assert np.ptp(slab.vertices @ normal) == pytest.approx(0.05, abs=1e-4)
