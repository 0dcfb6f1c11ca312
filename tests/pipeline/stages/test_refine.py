"""Stage refine: straight faces, passages that fit between them, rooms that do not lap."""

import numpy as np
import pytest
import shapely
from shapely.affinity import rotate

from pipeline.config import RefineConfig
from pipeline.geometry.openings import Opening
from pipeline.stages.refine import straighten_rooms
from pipeline.values import Spaces

CONFIG = RefineConfig()


def house(left: shapely.Polygon, right: shapely.Polygon, depth: float = 0.2) -> Spaces:
    opening = Opening(np.array([4.1, 1.5]), np.array([0.0, -1.0]), 0.9, depth, (0, 1))
    return Spaces(shapely.Polygon(), (left, right), (opening,))


def test_a_wall_of_skewed_slabs_has_one_thickness() -> None:
    left = shapely.Polygon([(0, 0), (4.0, 0), (4.01, 1.5), (3.99, 1.5), (4.0, 3), (0, 3)])
    right = shapely.Polygon([(4.2, 0), (7, 0.01), (7, 3), (4.19, 3), (4.21, 1.5)])
    found = straighten_rooms(house(left, right), CONFIG)
    thick = found.rooms[1].bounds[0] - found.rooms[0].bounds[2]
    assert thick == pytest.approx(0.2, abs=0.01)
    assert [len(r.exterior.coords) - 1 for r in found.rooms] == [4, 4]
    assert found.passages[0].depth == pytest.approx(thick, abs=1e-9)


def test_a_passage_is_fitted_between_the_new_faces() -> None:
    found = straighten_rooms(house(shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7, 3), depth=0.14), CONFIG)
    opening = found.passages[0]
    assert opening.centre == pytest.approx([4.1, 1.5])
    assert opening.depth == pytest.approx(0.2)
    assert opening.width == 0.9


def test_rooms_that_meet_under_a_beam_do_not_lap() -> None:
    left = shapely.Polygon([(0, 0), (4.02, 0), (4.0, 3), (0, 3)])
    right = shapely.Polygon([(4.02, 0), (7, 0), (7, 3), (4.0, 3)])
    one, other = straighten_rooms(Spaces(shapely.Polygon(), (left, right), (), open_pairs=((0, 1),)), CONFIG).rooms
    assert one.intersection(other).area < 1e-9
    assert one.union(other).area == pytest.approx(21.0, abs=0.05)


@pytest.mark.parametrize("degrees", [0, 17, 45])
def test_straight_rooms_at_any_angle_stay(degrees: float) -> None:
    rooms = [rotate(shapely.box(*b), degrees, origin=(0, 0)) for b in ((0, 0, 4, 3), (4.2, 0, 7, 3))]
    found = straighten_rooms(Spaces(shapely.Polygon(), tuple(rooms), ()), CONFIG)
    for before, after in zip(rooms, found.rooms, strict=True):
        assert after.hausdorff_distance(before) < 1e-6


def test_rooms_that_are_drawn_straight_are_those_that_were_there() -> None:
    rooms = (shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7, 3))
    assert all(a is b for a, b in zip(straighten_rooms(house(*rooms), CONFIG, rooms).rooms, rooms, strict=True))


def test_a_spur_of_millimetres_beside_a_jamb_is_gone() -> None:
    left = shapely.box(0, 0, 4, 3).union(shapely.box(4, 1.95, 4.1, 1.954))
    found = straighten_rooms(house(left, shapely.box(4.2, 0, 7, 3)), CONFIG)
    assert found.rooms[0].symmetric_difference(shapely.box(0, 0, 4, 3)).area < 1e-3
    assert len(found.rooms[0].exterior.coords) - 1 == 4
