"""Where a level ends that has more than a slab over it."""

from itertools import pairwise

import pytest

from pipeline.sources.storeys.levels import find_levels
from tests.builders.meshes import L_FLOOR, box, joined, sheet, slab, storey

EAVES = [(-0.5, -0.5, 8.5, -0.4), (-0.5, 6.4, 8.5, 6.5), (-0.5, -0.4, -0.4, 6.4), (8.4, -0.4, 8.5, 6.4)]


def test_a_slab_on_which_a_roofs_edge_stands_closes_the_level() -> None:
    """The edge is higher than a slab's tolerance and lower than an attic's walls."""
    edge = [box(side, 2.8, 3.2) for side in EAVES]
    (level,) = find_levels(joined([*slab(-0.2, 0.0), *storey(0.0, 2.5), *slab(2.5, 2.8), *edge]))
    assert level.ceiling_m == pytest.approx(2.45)


def test_a_hung_ceiling_through_which_the_walls_run_closes_nothing() -> None:
    tiles = slab(2.3, 2.32, L_FLOOR)
    (level,) = find_levels(joined([*slab(-0.2, 0.0), *storey(0.0, 2.7), *tiles]))
    assert level.ceiling_m == pytest.approx(2.7, abs=0.06)


def test_the_low_ceilings_of_some_rooms_close_no_level() -> None:
    """Rooms of sheets 2.3 m high, and one of 2.7 m that stands beside them."""
    low, high = (0.0, 0.0, 10.0, 6.0), (10.0, 0.0, 12.5, 4.0)
    rooms = [sheet((x, 0.0), (x, 6.0), 0.0, 2.3) for x in (3.0, 6.0)]
    for (x1, y1, x2, y2), top in ((low, 2.3), (high, 2.7)):
        corners = [(x1, y1), (x2, y1), (x2, y2), (x1, y2), (x1, y1)]
        rooms += [sheet(a, b, 0.0, top) for a, b in pairwise(corners)] + [box((x1, y1, x2, y2), top, top + 0.01)]
    (level,) = find_levels(joined([*slab(-0.2, 0.0, [low, high]), *rooms]))
    assert level.ceiling_m == pytest.approx(2.7, abs=0.06)
