"""``connect_rooms`` skips pairs that are known to be connected; planning every pair gives the same cuts.

The twin below is Algorithm 1, lines 9-17, word for word: no labelling decides whether there is a path.
"""

import numpy as np
import pytest

from houseexpo.analysis.graph import shortest_path
from pipeline.config import ConnectivityConfig
from pipeline.geometry.rooms_and_passages import erode_floor, sample_points, walkable_floor
from pipeline.stages.connectivity import CutRules, _joins_pieces, _with_cut, connect_rooms, cut_walls_along_lines
from pipeline.values import Spaces
from tests.builders.houses import Hole, Parts, level, shell, stage_values, three_rooms, two_rooms, wall

CONFIG = ConnectivityConfig(samples=24)


def connect_by_planning_every_pair(spaces: Spaces, config: ConnectivityConfig, rng: np.random.Generator) -> Spaces:
    """Take all pairs by increasing distance, plan each; where there is none, cut on the line and plan again."""
    radius = config.robot_radius_m
    points = sample_points(erode_floor(walkable_floor(spaces), radius), config.samples, rng)
    pairs = [(i, j) for i in range(len(points)) for j in range(i + 1, len(points))]
    for i, j in sorted(pairs, key=lambda pair: np.hypot(*(points[pair[0]] - points[pair[1]]))):
        while shortest_path(walkable_floor(spaces).buffer(-radius), points[i], points[j]) is None:
            floor = walkable_floor(spaces)
            rules = CutRules(config.cut_width_m, 1.5)
            pieces = erode_floor(floor, radius)
            on_line = cut_walls_along_lines(points[None, [i, j]], pieces, floor, spaces.walls, rules)
            cut = next((cut for _, cut in on_line if _joins_pieces(cut, pieces, floor, radius)), None)
            if cut is None:  # no clean cut near this line: another pair's will do
                break
            spaces = _with_cut(spaces, cut)
    return spaces


def two_flats() -> Parts:
    """Two flats of two rooms, each with an inner door, and no way from one to the other."""
    parting = wall((0, 4, 9, 4.2))
    lower = wall((4, 0, 4.1, 4), Hole(1, 1.9))
    upper = wall((5, 4.2, 5.1, 8), Hole(6, 6.9))
    return [*shell((0, 0, 9, 8)), *parting, *lower, *upper]


def with_a_shaft() -> Parts:
    """A flat round a shaft of 1 m2, and a closed room."""
    return [*shell((0, 0, 8, 5)), *shell((2, 2, 3, 3), 0.1), *wall((5.5, 0, 5.7, 5))]


HOUSES = {
    "two closed rooms": two_rooms(),
    "three rooms in a row": three_rooms(),
    "the first of three has a door": three_rooms([Hole(1, 1.9)]),
    "two flats": two_flats(),
    "a shaft": with_a_shaft(),
    "connected already": two_rooms(Hole(1, 1.9)),
}


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("name", HOUSES)
@pytest.mark.slow
def test_planning_every_pair_makes_the_same_cuts(name: str, seed: int) -> None:
    spaces = stage_values(level(HOUSES[name]))["isolated"]
    quick = connect_rooms(spaces, CONFIG, 2.0, np.random.default_rng(seed))
    slow = connect_by_planning_every_pair(spaces, CONFIG, np.random.default_rng(seed))
    assert len(quick.passages) == len(slow.passages)
    for one, other in zip(quick.passages, slow.passages, strict=True):
        assert one.kind == other.kind
        assert one.sides == other.sides
        np.testing.assert_allclose(one.segment, other.segment, atol=1e-12)
    assert len(erode_floor(walkable_floor(slow), CONFIG.robot_radius_m)) == 1
