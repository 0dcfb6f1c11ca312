import numpy as np
import pytest
import shapely

from pipeline.geometry.bodies import Box
from pipeline.geometry.doorways import doorway

LEAF = Box(np.array([2.0, 0.0]), np.array([1.0, 0.0]), 0.9, 0.04, 0.0, 2.0)


def test_a_leaf_between_two_jambs_stands_in_a_doorway_as_deep_as_the_wall() -> None:
    walls = shapely.union_all([shapely.box(0, -0.1, 1.5, 0.1), shapely.box(2.5, -0.1, 4, 0.1)])
    found = doorway(LEAF, walls)
    assert found is not None
    assert (found.width, found.thickness) == (pytest.approx(1.0), pytest.approx(0.2))


def test_a_leaf_between_two_posts_thinner_than_it_looks_into_them_stands_in_none() -> None:
    posts = shapely.union_all([shapely.box(1.47, -0.1, 1.5, 0.1), shapely.box(2.5, -0.1, 2.53, 0.1)])
    assert doorway(LEAF, posts) is None
