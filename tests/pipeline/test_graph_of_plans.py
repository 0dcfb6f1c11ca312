"""The graph of a plan has as many pieces as its free space: wherever floor joins two rooms, the graph does too."""

from __future__ import annotations

from pathlib import Path

import msgspec
import networkx as nx
import numpy as np
import pytest
import shapely

from houseexpo.analysis.graph import rooms_graph
from houseexpo.floorplan import FloorPlan, decode
from pipeline.values import SourceRoom
from tests.builders.houses import Hole, gap, kinds, level, plan_of, shell, wall
from tests.builders.kinds.measuring import plans_of
from tests.builders.kinds.registry import KINDS, RAW, make_member
from tests.builders.shared import DATA, needs_shared

FOUND = ("gap_12.glb", "gap_26.glb", "flat_stub_ways.glb", "B_cell_25.ply", "GD_closed_10.ply")
OPEN_PLANS = (
    "ifc/duplex/storey1_doors.ply",
    "ifc/fzk_haus/AC20-FZK-Haus.ifc",
    "gazebo/aws_small_house/structure_nodoors_visual.ply",
    "sweethome3d/ristrutturazione/home.sh3d",
)
"""Files whose rooms meet in the open."""


def pieces(plan: FloorPlan) -> int:
    return int(nx.number_connected_components(rooms_graph(plan)))


def plans_in(path: Path) -> list[FloorPlan]:
    return [decode(msgspec.json.encode(plan)) for plan in plans_of(path)[0]]


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_rooms_in_a_row_are_joined_whatever_is_between_them(seed: int, wide: bool) -> None:
    """A gap, a lintel or a beam of any width in each wall of four rooms."""
    rng = np.random.default_rng(seed)
    parts = shell((0.0, 0.0, 4 * 4.2 - 0.2, 5.0))
    for k in range(1, 4):
        width = rng.uniform(2.5, 4.4) if wide else rng.uniform(0.5, 2.5)
        start = rng.uniform(0.2, 4.8 - width)
        hole = gap(start, start + width) if rng.random() < 0.5 else Hole(start, start + width)
        parts += wall((4.2 * k - 0.2, 0.0, 4.2 * k, 5.0), hole)
    plan = plan_of(parts)
    assert pieces(plan) == 1
    assert "cut" not in kinds(plan)


def test_parts_of_a_space_that_the_source_divides_are_neighbours() -> None:
    rooms = [(0.0, 0.0, 3.0, 4.0), (3.0, 0.0, 8.0, 2.5), (3.0, 2.5, 8.0, 4.0)]
    drawn = tuple(
        SourceRoom((name,), (), polygon=shape)
        for name, shape in zip("abc", (shapely.box(*each) for each in rooms), strict=True)
    )
    plan = plan_of(level(shell((0.0, 0.0, 8.0, 4.0)), rooms=drawn))
    assert len(plan.rooms) == 3
    assert pieces(plan) == 1
    assert sorted(round(width, 1) for *_, width in rooms_graph(plan).edges(data="width")) == [1.5, 2.5, 5.0]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*KINDS, *RAW])
def test_the_graph_of_a_made_house_is_in_one_piece(kind: str, tmp_path: Path) -> None:
    for number in range(2):
        for plan in plans_in(make_member(kind, number, 3, tmp_path).path):
            assert pieces(plan) == 1


@needs_shared
@pytest.mark.parametrize("name", FOUND)
def test_the_graph_of_a_small_house_is_in_one_piece(name: str) -> None:
    for plan in plans_in(DATA / "found" / name):
        assert pieces(plan) == 1
        assert name != "gap_26.glb" or [door.width for door in plan.doors if door.kind == "opening"] == [2.6]


@needs_shared
@pytest.mark.slow
@pytest.mark.parametrize("name", OPEN_PLANS)
def test_the_graph_of_an_open_plan_is_in_one_piece(name: str) -> None:
    found = plans_in(DATA / name)
    assert found
    assert [pieces(plan) for plan in found] == [1] * len(found)
