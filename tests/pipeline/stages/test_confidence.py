"""How sure each door and room is: the features of known houses, and what the models make of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely import Polygon, box

from houseexpo.floorplan import FloorPlan, load_plan
from houseexpo.plan import DoorKind, Frame
from pipeline.algorithm import plan_largest_building
from pipeline.config import PipelineConfig
from pipeline.fitting.models import fit
from pipeline.fitting.rows import Part
from pipeline.geometry.areas import OUTSIDE
from pipeline.geometry.openings import Opening
from pipeline.quality import doubt_plan
from pipeline.sources import find, reader
from pipeline.stages.confidence import (
    FinalBuilding,
    add_confidences,
    passage_features,
    room_features,
    without_unlikely_entrances,
)
from pipeline.stages.connectivity import NO_EVIDENCE
from pipeline.stages.logistic import LogisticModel, load_models
from pipeline.values import Evidence, Layout, Level, Mesh, NamedRoom, SourceRoom, Spaces
from research.confidence_fit import measures, weights_of
from tests.builders import houses
from tests.builders.kinds.registry import make_member

NOTHING = Polygon()
ROOMS = (box(0, 0, 4, 4), box(4.2, 0, 8.2, 4))
WALLS = box(-0.2, -0.2, 8.4, 4.2).difference(shapely.union_all([*ROOMS, box(4, 1, 4.2, 1.9)]))
LEVEL = Level(
    "house",
    Mesh(np.empty((0, 3)), np.empty((0, 3), np.int64)),
    2.7,
    Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0),
)


def passage(kind: DoorKind = "door", closed_by: str = "lintel", width: float = 0.9, why: str = "") -> Opening:
    """The passage from the left room to the right one, or from the left one to the outside."""
    sides = (0, OUTSIDE) if kind == "entrance" else (0, 1)
    return Opening(np.array([4.1, 1.45]), np.array([0.0, -1.0]), width, 0.2, sides, kind, why=why, closed_by=closed_by)


def planned(*passages: Opening, level: Level = LEVEL, evidence: Evidence | None = None) -> FinalBuilding:
    """Two rooms side by side with these passages."""
    evidence = evidence or Evidence(WALLS, WALLS, NOTHING, NOTHING, NOTHING)
    layout = Layout(WALLS, box(-0.2, -0.2, 8.4, 4.2).difference(shapely.union_all(ROOMS)), (), ROOMS)
    return FinalBuilding(
        level, evidence, layout, Spaces(WALLS, ROOMS, passages), tuple(map(NamedRoom, ROOMS)), {}, np.zeros(0)
    )


def features(*passages: Opening, level: Level = LEVEL, evidence: Evidence | None = None) -> dict[str, float]:
    """The features of the first passage that are more than nothing."""
    first = passage_features(planned(*passages, level=level, evidence=evidence))[0]
    assert all(0 <= value <= 1 for value in first.values())
    return {name: round(value, 2) for name, value in first.items() if value}


def test_of_a_plain_door_is_said_only_what_closes_it() -> None:
    assert features(passage()) == {"lintel": 1.0}
    assert features(passage(closed_by="door")) == {"known": 1.0}
    assert features(passage(closed_by="door"), level=replace(LEVEL, named_openings=True)) == {
        "known": 1.0,
        "named": 1.0,
    }
    assert features(passage("opening", "gap")) == {"gap": 1.0}
    assert features(passage("opening", "mouth")) == {"mouth": 1.0}
    assert features(passage("cut", "", why=NO_EVIDENCE)) == {"cut": 1.0, "bare_cut": 1.0}


@pytest.mark.parametrize(
    ("confidences", "closed_by", "named", "left"),
    [
        ((0.9, 0.4), "lintel", False, [0.9]),
        ((0.9, 0.6), "lintel", False, [0.9, 0.6]),
        ((0.7, 0.4), "lintel", False, [0.7, 0.4]),  # none is sure
        ((0.4,), "lintel", False, [0.4]),
        ((0.9, 0.4), "door", True, [0.9, 0.4]),
        ((0.9, 0.4), "door", False, [0.9]),
        ((0.9, 0.4), "lintel", True, [0.9]),
    ],
)
def test_an_entrance_that_is_likely_none_is_left_out_beside_a_sure_one(confidences, closed_by, named, left) -> None:
    doubtful = replace(passage(), confidence=0.1)
    entrances = [replace(passage("entrance", closed_by), confidence=each) for each in confidences]
    house = planned(doubtful, *entrances, level=replace(LEVEL, named_openings=named))
    found = without_unlikely_entrances(house).spaces
    assert [p.confidence for p in found.passages] == [0.1, *left]
    lost = len(confidences) - len(left)
    assert found.notes == ({"unlikely_entrances": lost} if lost else {})


@pytest.mark.parametrize(("closed_by", "width", "left"), [("lintel", 0.9, 1), ("lintel", 0.5, 0), ("door", 0.5, 1)])
def test_a_slit_that_nobody_enters_by_is_left_out_though_no_entrance_is_sure(closed_by, width, left) -> None:
    house = planned(replace(entrance(width=width), closed_by=closed_by, confidence=0.4))
    assert len(without_unlikely_entrances(house).spaces.passages) == left


def test_a_plan_leaves_out_a_likely_window_beside_its_door() -> None:
    rated = LogisticModel(3.0, {"wide": -6.0})
    holes = [houses.Hole(1, 1.9), houses.Hole(4, 6.4)]
    config = PipelineConfig(weights={"entrance": rated})
    plan = houses.plan_of(houses.shell((0, 0, 8, 4), front=holes), config)
    assert [door.kind for door in plan.doors] == ["entrance"]
    assert plan.doors[0].width == pytest.approx(0.9)
    assert plan.provenance["notes"]["unlikely_entrances"] == 1


def test_odd_shapes_of_passages_count() -> None:
    assert features(passage(width=0.525)) == {"lintel": 1.0, "narrow": 0.5, "loose_end": 1.0}
    assert features(passage(width=1.85)) == {"lintel": 1.0, "wide": 0.5}
    assert features(passage(), passage()) == {"lintel": 1.0, "twin": 1.0}
    blocked = Evidence(WALLS, WALLS, NOTHING, NOTHING, box(4.2, 0, 4.5, 4))
    assert features(passage(), evidence=blocked) == {"lintel": 1.0, "blocked": 0.5}
    leaf = Evidence(WALLS, WALLS, NOTHING, NOTHING, NOTHING, leaves=(box(4.2, 1, 5.1, 1.05),))
    assert features(passage(), evidence=leaf) == {"lintel": 1.0, "leaf": 1.0}


def entrance(y: float = 1.45, width: float = 0.9) -> Opening:
    """A way from the left room, whose left wall is 0.2 m thick, to the outside."""
    return Opening(np.array([-0.1, y]), np.array([0.0, 1.0]), width, 0.2, (0, OUTSIDE), "entrance", closed_by="gap")


def wall_across(low: float, high: float, y: tuple[float, float]) -> Mesh:
    """An upright sheet in the middle of the left room's left wall."""
    corners = [[-0.1, end, z] for z in (low, high) for end in y]
    return Mesh(np.array(corners), np.array([[0, 1, 2], [1, 3, 2]]))


def test_what_stands_in_an_entrance_a_hand_above_the_floor_bars_it() -> None:
    for low, high, barred in ((0.0, 0.4, 1.0), (0.0, 0.08, 0.0), (0.3, 2.0, 0.0)):
        level = replace(LEVEL, walls=wall_across(low, high, (0.5, 2.5)))
        assert features(entrance(), level=level).get("barred", 0.0) == barred
    half = replace(LEVEL, walls=wall_across(0.0, 1.0, (0.5, 1.45)))
    assert features(entrance(), level=half)["barred"] == 0.5
    point = replace(half, walls=Mesh(half.walls.vertices, np.vstack([half.walls.faces, [1, 3, 3]])))
    assert features(entrance(), level=point)["barred"] == 0.5  # a face without area bars nothing
    scan = Evidence(WALLS, WALLS, NOTHING, NOTHING, NOTHING, scanned=True)
    assert "barred" not in features(entrance(), level=half, evidence=scan)


def test_a_closed_leaf_does_not_bar_a_door_that_the_source_names() -> None:
    level = replace(LEVEL, walls=wall_across(0.0, 2.0, (1.0, 1.9)))
    named = replace(level, named_openings=True)
    for closed_by, where, barred in (("door", named, None), ("opening", named, 1.0), ("door", level, 1.0)):
        assert features(replace(entrance(), closed_by=closed_by), level=where).get("barred") == barred


def test_an_entrance_is_one_of_several_of_its_room_or_the_only_way_into_it() -> None:
    assert features(entrance())["only_way"] == features(entrance(), passage("cut", ""))["only_way"] == 1.0
    assert "only_way" not in features(entrance(), passage())
    assert features(entrance(), entrance(3.0), passage())["other_ways_out"] == 0.33
    assert "other_ways_out" not in features(entrance(), passage())


def test_a_passage_onto_no_floor_counts() -> None:
    half = replace(LEVEL, floor=box(0, 0, 4.1, 4))
    assert features(passage(), level=half) == {"lintel": 1.0, "floorless": 1.0}
    named = replace(half, rooms=(SourceRoom((), (), polygon=ROOMS[1]),))
    assert features(passage(), level=named) == {"lintel": 1.0}


def test_of_rooms_is_said_how_they_close_and_what_leads_in() -> None:
    whole = planned(passage())
    left, right = room_features(whole)
    assert not any(left.values())
    assert left == right
    drawn = replace(whole, level=replace(LEVEL, rooms=(SourceRoom((), (), polygon=box(0, 0, 4, 2)),)))
    assert [room_features(drawn)[k]["unlike_drawn"] for k in (0, 1)] == [0.5, 1.0]
    open_side = Opening.closing(box(8.2, 0, 8.4, 4), "wall_ends")
    given = replace(whole, layout=replace(whole.layout, candidates=(open_side,)))
    assert room_features(given)[0]["given_edge"] == 0.0
    assert room_features(given)[1]["given_edge"] == pytest.approx(0.25, abs=0.01)
    only_cut = planned(passage("cut", "", why=NO_EVIDENCE))
    assert room_features(only_cut)[0]["only_cuts"] == 1.0


def test_a_model_is_a_logistic_function_of_its_features() -> None:
    model = LogisticModel(1.0, {"narrow": -2.0})
    assert [model.confidence({"narrow": x}) for x in (0.0, 0.5, 1.0)] == [0.73, 0.5, 0.27]
    assert model.confidence({"unheard of": 1.0}) == 0.73


def test_a_known_door_is_surer_than_a_lintels_and_that_surer_than_a_bare_cut() -> None:
    door = load_models()["door"]
    sure = [
        door.confidence(features(p)) for p in (passage(closed_by="door"), passage(), passage("cut", why=NO_EVIDENCE))
    ]
    assert sure[0] >= sure[1] > sure[2]


def test_a_house_with_sills_is_not_rated() -> None:
    whole = planned(passage(), level=replace(LEVEL, sills=True))
    assert add_confidences(whole) is whole


def plan_of(path: Path) -> FloorPlan:
    """The plan of the first level of a file."""
    (item,) = find(str(path))
    level = next(iter(reader(item.reader).read(item)))
    assert isinstance(level, Level)
    return plan_largest_building(level, PipelineConfig(), np.random.default_rng(0))


def test_the_parts_of_a_plain_house_are_sure_and_say_so_in_the_file(tmp_path: Path) -> None:
    plan = plan_of(make_member("artist_named", 0, 0, tmp_path).path)
    assert plan.doors
    assert plan.rooms
    assert all(part.confidence is not None and 0 <= part.confidence <= 1 for part in (*plan.rooms, *plan.doors))
    inner = [door for door in plan.doors if door.kind == "door"]
    assert not any(door.is_unsure for door in inner)
    plan.save(tmp_path / "plan.json")
    again = load_plan(tmp_path / "plan.json")
    assert [door.confidence for door in again.doors] == [door.confidence for door in plan.doors]
    assert [room.confidence for room in again.rooms] == [room.confidence for room in plan.rooms]


def parts(rng: np.random.Generator, count: int, group: str) -> list[Part]:
    """Doors that are true with the odds that their features give: 3 - 4 x narrow."""
    narrow = rng.uniform(0, 1, count)
    true = rng.uniform(0, 1, count) < 1 / (1 + np.exp(4 * narrow - 3))
    return [Part("door", "", group, bool(t), {"narrow": float(x)}) for x, t in zip(narrow, true, strict=True)]


def test_the_fit_finds_the_odds_that_made_the_doors() -> None:
    rng = np.random.default_rng(1)
    model = fit(parts(rng, 8000, "solids"), ["narrow", "wide"], np.ones(8000))
    assert (model.bias, model.weights["narrow"]) == (pytest.approx(3.0, abs=0.2), pytest.approx(-4.0, abs=0.3))
    assert "wide" not in model.weights  # no door is wide
    others = parts(rng, 8000, "solids")
    scores = np.array([model.confidence(part.features) for part in others])
    found = measures(scores, np.array([part.true for part in others]))
    assert found["calibration"] < 0.03
    assert 0.7 < found["area"] < 0.95
    assert measures(1 - scores, np.array([part.true for part in others]))["area"] == pytest.approx(1 - found["area"])


def test_real_houses_weigh_as_much_as_all_made_ones() -> None:
    rng = np.random.default_rng(2)
    weight = weights_of([*parts(rng, 300, "solids"), *parts(rng, 20, "corpus 1")])
    assert weight[:300].sum() == pytest.approx(weight[300:].sum())
    assert weight.sum() == pytest.approx(320)  # the ridge is as strong however many are made


def test_a_marked_house_is_as_doubtful_as_its_own_model_of_quality_says() -> None:
    grounds = {"cut_share": 0.5}
    marked, other = (
        passage_features(replace(planned(passage(), level=replace(LEVEL, sills=sills)), grounds=grounds))[0]
        for sills in (True, False)
    )
    assert marked["doubtful_plan"] == doubt_plan(grounds, marked=True)
    assert marked["doubtful_plan"] != pytest.approx(other["doubtful_plan"], abs=0.05)


def test_few_parts_show_a_calibration_error_by_chance() -> None:
    scores = np.full(400, 0.8)
    true = np.arange(400) % 5 > 0
    few, many = measures(scores[:25], true[:25]), measures(scores, true)
    assert few["calibration"] == many["calibration"] == pytest.approx(0.0, abs=1e-9)
    assert few["by chance"] == pytest.approx(np.sqrt(2 / np.pi * 0.8 * 0.2 / 25), rel=0.1)
    assert many["by chance"] == pytest.approx(few["by chance"] / 4, rel=0.15)


def test_rooms_of_a_doubtful_plan_are_less_sure_and_doors_weigh_its_grounds() -> None:
    models = load_models()
    sure, unsure = (models["room"].confidence({"doubtful_plan": value}) for value in (0.0, 1.0))
    assert unsure < sure - 0.02
    assert not any(name.startswith("plan_") for part in ("entrance", "room") for name in models[part].weights)
    assert "doubtful_plan" not in models["door"].weights
    assert "doubtful_plan" in models["entrance"].weights
