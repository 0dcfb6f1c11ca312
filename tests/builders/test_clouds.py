"""What a survey does to the points of a made home."""

import numpy as np
import pytest
import shapely

from tests.builders.kinds.cloud import AGAIN_M, OUTSIDE_M, _seen, _seen_again, _through_glass
from tests.builders.kinds.homes import Style, random_home


@pytest.fixture(scope="module")
def surveyed():
    rng = np.random.default_rng(3)
    storey = random_home(rng, Style(size="small", windows=1.0))
    return storey, _seen(storey, rng)


def test_a_side_is_seen_again_five_to_fifteen_centimetres_off(surveyed):
    storey, points = surveyed
    again = _seen_again(points, storey, np.random.default_rng(0))
    assert len(again) > 1000
    sides = shapely.MultiLineString([room.exterior for room in storey.rooms])
    away = shapely.distance(sides, shapely.points(again[:, 0], again[:, 1]))
    assert np.median(away) > AGAIN_M[0] / 2
    assert np.quantile(away, 0.95) < AGAIN_M[1] + 0.05


def test_through_clear_glass_the_ground_outside_is_seen(surveyed):
    storey, points = surveyed
    seen = _through_glass(points, storey, np.random.default_rng(0))
    house = shapely.union_all([*storey.rooms, storey.wall_area])
    beyond = seen[shapely.distance(house, shapely.points(seen[:, 0], seen[:, 1])) > 0.1]
    assert len(beyond) > 100
    assert np.abs(beyond[:, 2]).max() <= 0.3
    assert shapely.distance(house, shapely.MultiPoint(beyond[:, :2])) < OUTSIDE_M
