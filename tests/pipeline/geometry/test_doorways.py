import numpy as np
import pytest
import shapely

from pipeline.geometry.doorways import doorway
from pipeline.geometry.known_doors import leaves_in_recesses
from pipeline.geometry.meshes import Box

LEAF = Box(np.array([2.0, 0.0]), np.array([1.0, 0.0]), 0.9, 0.04, 0.0, 2.0)


def test_a_leaf_between_two_jambs_stands_in_a_doorway_as_deep_as_the_wall() -> None:
    walls = shapely.union_all([shapely.box(0, -0.1, 1.5, 0.1), shapely.box(2.5, -0.1, 4, 0.1)])
    found = doorway(LEAF, walls)
    assert found is not None
    assert (found.width, found.thickness) == (pytest.approx(1.0), pytest.approx(0.2))


def test_a_leaf_between_two_posts_thinner_than_it_looks_into_them_stands_in_none() -> None:
    posts = shapely.union_all([shapely.box(1.47, -0.1, 1.5, 0.1), shapely.box(2.5, -0.1, 2.53, 0.1)])
    assert doorway(LEAF, posts) is None


def _askew(degrees: float, beside_m: float = 0.0) -> shapely.Geometry:
    """Two pieces of wall about a gap of 0.9 m, turned about the leaf's middle; the second is moved across."""
    pieces = shapely.union_all([shapely.box(0, -0.1, 1.55, 0.1), shapely.box(2.45, -0.1 + beside_m, 4, 0.1 + beside_m)])
    return shapely.affinity.rotate(pieces, degrees, origin=(2.0, 0.0))


def test_a_doorway_lies_along_the_wall_that_its_leaf_is_askew_to() -> None:  # R1
    found = doorway(LEAF, _askew(8.0))
    assert found is not None
    assert np.rad2deg(np.arctan2(*found.along[::-1])) == pytest.approx(8.0, abs=0.2)
    assert found.centre == pytest.approx([2.0, 0.0], abs=0.01)
    assert (found.width, found.thickness) == (pytest.approx(0.9, abs=0.03), pytest.approx(0.2, abs=0.01))


def test_a_doorway_between_two_walls_side_by_side_is_not_turned() -> None:  # R2
    found = doorway(LEAF, _askew(0.0, beside_m=0.08))
    assert found is not None
    assert found.along == pytest.approx([1.0, 0.0])
    assert found.thickness == pytest.approx(0.2)


@pytest.mark.parametrize(("jambs", "found"), [(True, 1), (False, 0)])
def test_a_leaf_that_is_one_body_with_its_wall_stands_in_a_recess_between_jambs(jambs: bool, found: int) -> None:
    """A wall of 20 cm with a leaf of 4 cm under a lintel; or a wall of 4 cm, before which boards hang."""
    leaf, lintel = shapely.box(2.0, 0.0, 2.9, 0.04), shapely.box(2.0, 0.04, 2.9, 0.2)
    thick = 0.2 if jambs else 0.04
    walls = shapely.union_all([shapely.box(0.0, 0.0, 2.0, thick), leaf, shapely.box(2.9, 0.0, 5.0, thick)])
    assert len(leaves_in_recesses(lintel, walls)) == found
