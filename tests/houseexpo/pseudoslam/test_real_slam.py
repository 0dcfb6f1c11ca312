"""A house through PseudoSLAM and through real SLAMs: the maps agree."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import shapely

from houseexpo.floorplan import FloorPlan
from tests.builders.real_slam import (
    Run,
    SlamMap,
    compare,
    explore,
    need_gmapping,
    need_icp_slam,
    run_gmapping,
    run_icp_slam,
)


def flat() -> FloorPlan:
    """Five rooms round a hall, 70 m2, walls of 0.1 m, doors of 0.9 m."""
    rooms = [
        (0.0, 0.0, 4.0, 5.0),
        (4.1, 0.0, 8.5, 3.4),
        (4.1, 3.5, 11.0, 5.0),
        (8.6, 0.0, 11.0, 3.4),
        (0.0, 5.1, 5.2, 8.0),
        (5.3, 5.1, 9.0, 8.6),
    ]
    doors = [
        (4.0, 3.8, 4.1, 4.7),
        (6.0, 3.4, 6.9, 3.5),
        (9.2, 3.4, 10.1, 3.5),
        (4.2, 5.0, 5.1, 5.1),
        (7.0, 5.0, 7.9, 5.1),
    ]
    outline = shapely.union_all([shapely.box(*corners) for corners in rooms + doors]).exterior
    return FloorPlan("flat", list(outline.coords)[:-1], len(rooms), {})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("need_it", "run_it"), [(need_icp_slam, run_icp_slam), (need_gmapping, run_gmapping)], ids=["icp-slam", "gmapping"]
)
def test_a_real_slam_draws_the_same_house(
    need_it: Callable[[], None], run_it: Callable[[Run, Path], SlamMap], tmp_path: Path
) -> None:
    need_it()
    run = explore(flat())
    found = run_it(run, tmp_path)
    assert compare(run, found).iou >= 0.96
    assert run.ms_per_scan < found.ms_per_scan
