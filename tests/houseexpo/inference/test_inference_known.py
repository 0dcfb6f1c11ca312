"""Plans whose rooms and doors are known, with all of that hidden."""

from __future__ import annotations

from dataclasses import replace

import pytest

from houseexpo.inference import with_rooms
from tests.builders.batch import made_plans
from tests.builders.matching import bare, matches, total
from tests.builders.shared import CASES, DATA, NOT_YET, as_json, case, needs_shared, plan_nearest, scorer

HOUSES, SEED = 12, 5
LEAST = 0.85


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Plans that the pipeline makes of a few houses."""
    return made_plans(tmp_path_factory.mktemp("houses"), HOUSES, SEED)


@pytest.mark.slow
@pytest.mark.parametrize("holes", [True, False])
def test_rooms_and_doors_of_the_pipelines_plans_are_found_again(made, holes):
    counts = total([matches(plan, with_rooms(bare(plan, holes=holes))) for plan in made])
    assert counts.rooms_known > 50
    assert min(counts.rates()) >= LEAST


def test_labels_of_the_pipelines_plans_come_back(made):
    known = found = 0
    for plan in made:
        ours = with_rooms(bare(plan))
        for room in plan.rooms:
            twin = max(ours.rooms, key=lambda other: other.polygon.intersection(room.polygon).area)
            if room.label != "Unlabelled":
                known += 1
                found += room.label in twin.source_labels
    assert found >= 0.95 * known


@needs_shared
@pytest.mark.slow
def test_real_houses_are_divided_again_from_their_rings():
    rates: dict[str, list[float]] = {}
    for name in sorted(set(CASES) - set(NOT_YET)):
        truth = case(name)
        plan = plan_nearest(DATA / truth["mesh"], truth["floor_z"])
        score = scorer()(as_json(with_rooms(replace(plan, rooms=(), doors=()))), truth)
        assert score["valid"], name
        for key in ("room_recall", "room_precision", "door_recall", "door_precision"):
            rates.setdefault(key, []).append(score[key])
    for key, values in rates.items():
        assert sum(values) / len(values) >= LEAST, key
