"""Stage planes: what stands at h_d, and what closes its gaps above and below."""

import numpy as np
import pytest
import shapely
import trimesh

from pipeline.config import EvidenceConfig, PlanesConfig
from pipeline.rejection import Reason, Rejection
from pipeline.stages.evidence import gather_evidence
from pipeline.stages.planes import find_planes
from pipeline.values import Level, Planes, SourceObject
from tests.builders.houses import Hole, level, sheet_wall, shell, two_rooms, wall, window
from tests.builders.meshes import Mesh, box, joined

DOORWAY = shapely.box(4.0, 1.0, 4.2, 1.9)
CONFIG = PlanesConfig()


def cut(house: Level, config: PlanesConfig = CONFIG) -> Planes:
    return find_planes(house, gather_evidence(house, EvidenceConfig()), config)


def planes(parts: list, **values: object) -> Planes:
    return cut(level(parts, **values))


def test_a_door_is_open_in_one_plane_and_closed_in_the_other() -> None:
    found = planes(two_rooms(Hole(1.0, 1.9)))
    assert not found.door.intersects(DOORWAY.buffer(-0.01))
    assert found.lintels.symmetric_difference(DOORWAY).area < 0.01
    assert found.sills.is_empty
    assert found.tall.symmetric_difference(found.door).area < 1e-3


def test_a_sill_closes_the_door_at_the_ground_plane_as_in_the_paper() -> None:
    found = planes(two_rooms(Hole(1.0, 1.9, low=0.04)), sills=True)
    assert found.sills.symmetric_difference(DOORWAY).area < 0.01
    assert found.lintels.is_empty
    assert found.heights == {"ground": 0.01, "door": 0.2}


@pytest.mark.parametrize("head", [1.9, 2.0, 2.3, 2.42])
def test_a_lintel_may_be_at_any_height(head: float) -> None:
    assert planes(two_rooms(Hole(1.0, 1.9, 0.0, head))).lintels.symmetric_difference(DOORWAY).area < 0.01


def test_a_window_opens_neither_plane() -> None:
    found = planes([*shell((0, 0, 5, 4), front=[window(1, 2)])])
    hole = shapely.box(1, -0.2, 2, 0)
    assert found.door.covers(hole.buffer(-0.01))
    assert not found.lintels.intersects(hole.buffer(-0.01))


def test_what_ends_below_the_walls_beside_it_is_no_lintel() -> None:
    cabinet = box((0, 0, 0.35, 3), 1.4, 2.2)
    assert planes([*shell((0, 0, 4, 3)), cabinet]).lintels.is_empty


def test_a_railing_and_a_parapet_are_kept_apart() -> None:
    rail = box((1, 1, 3, 1.05), 0.95, 1.0)
    found = planes([*shell((0, 0, 4, 3)), rail])
    assert found.rails.symmetric_difference(shapely.box(1, 1, 3, 1.05)).area < 1e-3
    assert not found.door.intersects(shapely.box(1, 1, 3, 1.05))


def test_no_ceiling_slope_or_slab_is_wall() -> None:
    slab = box((-0.2, -0.2, 7.4, 3.2), 2.3, 2.7)
    slope = Mesh(
        np.array([(0, 0, 1.9), (7, 0, 1.9), (7, 3, 2.4), (0, 3, 2.4)], float), np.array([(0, 1, 2), (0, 2, 3)])
    )
    house = level([*two_rooms(Hole(1.0, 1.9)), slab], furniture=(SourceObject((), slope),), ceiling_m=2.7)
    assert cut(house).lintels.symmetric_difference(DOORWAY).area < 0.01


def test_a_stair_is_no_lintel() -> None:
    steps = [box((1.0, 0.3 * k, 2.0, 0.3 * k + 0.3), 0.0, 0.18 * (k + 1)) for k in range(9)]
    found = planes([*shell((0, 0, 4, 3)), *steps])
    assert found.lintels.is_empty


def test_low_furniture_is_no_wall_whether_the_source_names_it_or_not() -> None:
    table = box((1, 1, 3, 2.1), 0.0, 0.75)
    for found in (planes([*shell((0, 0, 4, 3)), table]), planes(shell((0, 0, 4, 3)), furniture=(_named(table),))):
        assert not found.door.intersects(shapely.box(1.01, 1.01, 2.99, 2.09))


def _named(part: trimesh.Trimesh) -> SourceObject:
    return SourceObject(("table",), joined([part]))


@pytest.mark.parametrize("sills", [True, False])
def test_no_cut_runs_through_coplanar_faces(sills: bool) -> None:
    levels = [0.01, 0.2, 0.45, 1.1, 1.7]
    steps = [box((1, 1 + 0.1 * k, 3, 1.1 + 0.1 * k), 0.0, top) for k, top in enumerate(levels)]
    heights = planes([*shell((0, 0, 4, 3)), *steps], sills=sills).heights
    for height in heights.values():
        assert np.abs(np.array(levels)[:, None] - np.atleast_1d(height)).min() > 1e-3


def test_sheets_have_lintels_too() -> None:
    found = planes([*sheet_wall((0, 0), (5, 0), Hole(1, 1.9)), *sheet_wall((5, 0), (5, 4))])
    assert found.lintels.symmetric_difference(shapely.box(1, -0.025, 1.9, 0.025)).area < 2e-3


@pytest.mark.parametrize("n_objects", [0, 12])
def test_a_scene_of_objects_only_has_no_layout(n_objects: int) -> None:
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    with pytest.raises(Rejection, match="no wall stands") as caught:
        cut(level(empty, n_objects=n_objects))
    assert (caught.value.stage, caught.value.reason) == ("planes", Reason.NO_LAYOUT)
    assert (f"{n_objects} objects" in str(caught.value)) == bool(n_objects)


def test_other_heights_can_be_asked_for() -> None:
    parts = [*wall((0, 0, 4, 0.2), Hole(1, 2, 0.0, 0.5)), *shell((0, 0, 4, 3))]
    assert cut(level(parts, sills=True), PlanesConfig(door_m=0.6)).heights["door"] == 0.6
    assert gather_evidence(level(parts), EvidenceConfig(breast_m=1.3)).heights["breast"] == 1.3
