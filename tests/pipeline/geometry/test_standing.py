import numpy as np
import pytest
import shapely

from pipeline.geometry.areas import OUTSIDE
from pipeline.geometry.bridges import Bridge
from pipeline.geometry.spaces import floor_of, piece_of, sample, standing_pieces
from pipeline.values import Passage, Spaces

ROOMS = (shapely.box(0, 0, 4, 3), shapely.box(4.2, 0, 7.2, 3))


def spaces(width: float, kind: str = "door") -> Spaces:
    sides = (0, OUTSIDE) if kind == "entrance" else (0, 1)
    bridge = Bridge(np.array([4.1, 1.5]), np.array([0.0, -1.0]), width, 0.2, sides)
    return Spaces(shapely.Polygon(), ROOMS, (Passage(bridge, kind),))


@pytest.mark.parametrize(
    ("width", "kind", "pieces"), [(0.8, "door", 1), (0.41, "cut", 1), (0.39, "door", 2), (0.8, "entrance", 2)]
)
def test_a_passage_joins_what_the_disc_gets_through(width: float, kind: str, pieces: int) -> None:
    assert len(standing_pieces(floor_of(spaces(width, kind)), 0.2)) == pieces


def test_pieces_come_largest_first_without_specks() -> None:
    floor = shapely.union_all([ROOMS[1], ROOMS[0], shapely.box(10, 0, 10.42, 0.42)])
    assert [round(p.area, 2) for p in standing_pieces(floor, 0.2)] == [9.36, 6.76]


def test_samples_are_uniform_and_every_piece_has_one() -> None:
    pieces = standing_pieces(floor_of(spaces(0.3)), 0.2)
    points = sample(pieces, 1000, np.random.default_rng(3))
    assert points.shape == (1002, 2)
    assert shapely.contains_xy(shapely.union_all(pieces).buffer(1e-9), *points.T).all()
    share = (piece_of(points, pieces) == 0).mean()
    assert share == pytest.approx(3.6 / 6.2, abs=0.05)
    assert set(piece_of(points[:2], pieces).tolist()) == {0, 1}


def test_a_seed_gives_the_same_points() -> None:
    pieces = standing_pieces(ROOMS[0], 0.2)
    first, second = (sample(pieces, 50, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(first, second)
