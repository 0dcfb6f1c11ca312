"""Mesh files whose walls are cut off low, as those of a dollhouse, and models to a scale, which are not."""

import numpy as np
import pytest
import shapely

from pipeline.config import EvidenceConfig
from pipeline.stages.evidence import gather_evidence
from pipeline.values import CUT_OFF, Mesh
from tests.builders.houses import plan_of
from tests.builders.meshes import as_trimesh, box, joined, read, slab, storey, table, write

CUT_M = 1.2
SILL = (5.0, 5.8, 6.5, 6.0)
DOORS = ((1.0, 0.0, 1.9, 0.2), (4.0, 1.0, 4.15, 1.9), (4.0, 4.2, 4.15, 5.1))
FLOOR = [(0.0, 0.0, 9.0, 6.0)]
WALLS = (
    *((0.0, 0.0, 1.0, 0.2), (1.9, 0.0, 9.0, 0.2), (8.8, 0.2, 9.0, 5.8), (0.0, 0.2, 0.2, 5.8)),
    *((0.0, 5.8, 5.0, 6.0), (6.5, 5.8, 9.0, 6.0), (4.15, 3.0, 8.8, 3.15)),
    *((4.0, 0.2, 4.15, 1.0), (4.0, 1.9, 4.15, 4.2), (4.0, 5.1, 4.15, 5.8)),
)


def house(by: float = 1.0, *, lintels: bool = False, ceiling: bool = False) -> Mesh:
    """Three rooms with two doors between them, an entrance, a window and a table, ``by`` times as large."""
    parts = [*storey(0.0, CUT_M, WALLS), *slab(-0.2, 0.0, FLOOR), box(SILL, 0.0, 0.9), table(1.0, 3.0, 0.0)]
    parts += [box(door, 0.77 * CUT_M, CUT_M) for door in DOORS] if lintels else []
    parts += slab(CUT_M, CUT_M + 0.1, FLOOR) if ceiling else []
    whole = joined(parts)
    return Mesh(whole.vertices * by, whole.faces)


@pytest.mark.parametrize(("name", "by"), [("a.glb", 1.0), ("a.obj", 1.0), ("a.obj", 100.0), ("a.glb", 100.0)])
def test_walls_that_are_cut_off_keep_their_scale_and_their_doors(tmp_path, name, by):
    """Every way is a gap then, and a window leaves a low wall."""
    (level,) = read(write(house(by), tmp_path / name))
    assert level.ceiling_m == pytest.approx(2.7, abs=0.02)
    assert level.guesses == ((CUT_OFF,) if by == 1.0 else ("units", CUT_OFF))
    assert level.provenance["wall_height"] == "drawn up from 1.20 m to 2.7 m"
    plan = plan_of(level)
    assert (len(plan.rooms), len(plan.doors)) == (3, 3)
    assert plan.area == pytest.approx(8.6 * 5.6, rel=0.03)


@pytest.mark.parametrize("parts", [{"lintels": True}, {"ceiling": True}])
def test_a_model_with_lintels_or_a_ceiling_has_whole_walls(tmp_path, parts):
    (level,) = read(write(house(**parts), tmp_path / "a.glb"))
    assert CUT_OFF not in level.guesses
    assert np.ptp(level.walls.vertices[:, 0]) == pytest.approx(9.0 * 2.7 / CUT_M, rel=0.15)


def test_a_window_leaves_a_wall_between_two_ends_and_a_parapet_across_them_is_none(tmp_path):
    recess = [box((9.0, 0.0, 11.0, 0.2), 0.0, CUT_M), box((9.0, 5.8, 11.0, 6.0), 0.0, CUT_M)]
    parapet = (10.8, 0.2, 11.0, 5.8)
    whole = joined([as_trimesh(house()), *recess, box(parapet, 0.0, 0.9)])
    (level,) = read(write(whole, tmp_path / "a.glb"))
    evidence = gather_evidence(level, EvidenceConfig())
    assert evidence.walls.intersection(shapely.box(*SILL)).area == pytest.approx(1.5 * 0.2, rel=0.05)
    assert evidence.walls.intersection(shapely.box(*parapet)).area < 0.02
    assert evidence.rails.intersection(shapely.box(*parapet)).area == pytest.approx(5.6 * 0.2, rel=0.05)


def test_a_model_in_gltf_is_not_laid_on_its_side(tmp_path):
    """Upright it is a house in no known unit, but to a scale; on its side its storey is 4.3 m high in metres."""
    floor = [(0.0, 0.0, 15.0, 10.0)]
    shell = [(0.0, 0.0, 15.0, 0.2), (14.8, 0.2, 15.0, 9.8), (0.0, 0.2, 0.2, 9.8), (0.0, 9.8, 15.0, 10.0)]
    whole = joined([*storey(0.0, 3.7, shell), *slab(-0.2, 0.0, floor), *slab(3.7, 3.9, floor)])
    (level,) = read(write(Mesh(whole.vertices * 0.45, whole.faces), tmp_path / "a.glb"))
    assert level.frame.up == "y"
