"""A room of points of which one side was not seen: its plan says so."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from houseexpo.plan import Frame
from pipeline.config import EvidenceConfig
from pipeline.stages.evidence import gather_scan_evidence
from pipeline.values import Level, Mesh
from tests.builders.shared import planned

CORNERS = [(4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (0.0, 0.0), (4.0, 0.0)]


def level(sides: int) -> Level:
    """A floor of 4 x 4 m with so many walls of 2.5 m, as points."""
    rng = np.random.default_rng(0)
    parts = [np.column_stack([rng.random((16_000, 2)) * 4.0, np.zeros(16_000)])]
    for a, b in list(pairwise(CORNERS))[:sides]:
        u, z = rng.random((2, 10_000, 1))
        parts.append(np.hstack([np.array(a) + u * np.subtract(b, a), 2.5 * z]))
    walls = Mesh(np.concatenate(parts), np.empty((0, 3), np.int64))
    return Level("room", walls, 2.5, Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0))


def test_an_open_edge_is_no_wall_and_lies_beside_the_walls() -> None:  # R4
    evidence = gather_scan_evidence(level(3), EvidenceConfig())
    assert evidence.open_edge.area > 0.4
    assert evidence.open_edge.intersection(evidence.walls).area < 1e-6
    assert gather_scan_evidence(level(4), EvidenceConfig()).open_edge.is_empty


@pytest.mark.parametrize(("sides", "notes"), [(4, {}), (3, {"boundary": "floor_edge"})])
def test_a_plan_says_that_a_side_was_not_seen(sides: int, notes: dict[str, str]) -> None:  # layout R2
    plan = planned(level(sides))
    assert plan.area == pytest.approx(16.0, abs=0.8)
    assert plan.provenance["notes"] == notes
    assert plan.quality is not None
    assert plan.quality.grounds["given_edge"] == float(bool(notes))


def test_a_room_with_an_open_side_is_doubted_more() -> None:
    whole, part = planned(level(4)), planned(level(3))
    assert part.quality is not None
    assert whole.quality is not None
    assert part.quality.score < whole.quality.score - 0.1
    assert part.rooms[0].confidence < whole.rooms[0].confidence
