"""Fits on a person's labels: a kind in which the program errs is learnt, and nothing else is made of chance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from pipeline.fitting.models import FEWEST_HOUSES, fit, fit_own_models, root_weights
from pipeline.fitting.rows import HouseRows, Part, PlanRow
from pipeline.stages.logistic import load_models

Truth = Callable[[dict[str, float], np.random.Generator], bool]


def houses(count: int, name: str, truth: Truth, seed: int = 0) -> list[HouseRows]:
    """Houses with eight parts of one sort each, whose features are drawn, and which are true by ``truth``."""
    rng = np.random.default_rng(seed)
    features = sorted(load_models()[name].weights)
    found = []
    for k in range(count):
        parts = []
        for _ in range(8):
            row = {feature: float(rng.random() < 0.3) for feature in features if not feature.startswith("plan_")}
            parts.append(Part(name, f"house {k}", "reviewed", truth(row, rng), row))
        spaces = parts if name == "space" else []
        plan = PlanRow(f"house {k}", "reviewed", None, {}, [], [] if spaces else parts)
        found.append(HouseRows([plan], spaces))
    return found


def as_shipped(name: str) -> Truth:
    """What the program believes, drawn by its own probabilities."""
    sound = {"doubtful_plan": 0.0, "doubtful_space": 0.0}  # the plan and its spaces
    return lambda row, rng: bool(rng.random() < load_models()[name].confidence(row | sound))


@pytest.mark.parametrize(("name", "feature"), [("entrance", "barred"), ("space", "seen_from_outside"), ("door", "cut")])
def test_a_kind_in_which_the_program_errs_is_learnt(name: str, feature: str) -> None:
    kind = houses(40, name, lambda row, _: row[feature] == 1.0)
    found = fit_own_models(kind)
    assert list(found.models) == [name]
    compared = next(each for each in found.comparisons if each.part == name)
    assert compared.houses == 40
    assert compared.right + compared.wrong == 320
    assert compared.own < 0.1 < compared.shipped
    others = houses(40, name, lambda row, _: row[feature] == 1.0, seed=1)
    parts = [part for row in others for part in (*row.spaces, *row.plans[0].parts)]
    told = [(found.models[name].confidence(part.features) > 0.5) == part.true for part in parts]
    shipped = [(load_models()[name].confidence(part.features) > 0.5) == part.true for part in parts]
    assert np.mean(told) > 0.85
    assert np.mean(shipped) < 0.7
    assert all(each.is_untried for each in found.comparisons if each.part != name)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["entrance", "door", "room", "space"])
def test_where_the_program_is_right_its_weights_stay(name: str) -> None:
    kept = [bool(fit_own_models(houses(40, name, as_shipped(name), seed)).models) for seed in range(6)]
    assert sum(kept) <= 1


def test_neither_order_nor_chance_shows_and_the_seed_moves_only_the_measure() -> None:
    kind = houses(30, "entrance", lambda row, _: row["barred"] == 1.0)
    found = fit_own_models(kind, seed=3)
    assert fit_own_models(kind[::-1], seed=3) == found
    other = fit_own_models(kind, seed=4)
    assert other.models == found.models
    assert other.comparisons != found.comparisons


def test_rooms_are_rated_by_the_space_model_that_is_kept() -> None:
    spaces = houses(40, "space", lambda _, __: True)
    rows = []
    for row in spaces:  # a room in each space: true as its space is
        rooms = [
            Part("room", part.house, part.group, part.true, {f"space:{n}": v for n, v in part.features.items()})
            for part in row.spaces
        ]
        plan = PlanRow(row.plans[0].house, "reviewed", None, {}, [part.features for part in row.spaces], rooms)
        rows.append(HouseRows([plan], row.spaces))
    found = fit_own_models(rows)
    assert "space" in found.models
    rooms_compared = next(each for each in found.comparisons if each.part == "room")
    alone = fit_own_models([HouseRows(row.plans, []) for row in rows])
    assert rooms_compared.shipped < next(each for each in alone.comparisons if each.part == "room").shipped


def test_few_houses_are_refused_with_what_to_do() -> None:
    few = houses(FEWEST_HOUSES - 1, "entrance", lambda row, _: row["barred"] == 1.0)
    with pytest.raises(ConfigError, match=rf"of {FEWEST_HOUSES} houses or more, found 9 houses; review more of them"):
        fit_own_models(few)
    with pytest.raises(ConfigError, match="found 0 houses"):
        fit_own_models([])


def test_a_house_counts_with_the_root_of_its_parts() -> None:
    parts = [Part("door", name, "reviewed", True, {}) for name in "aaaab"]
    assert root_weights(parts).tolist() == [0.5] * 4 + [1.0]


def test_without_labels_the_model_stays_as_it_is() -> None:
    start = load_models()["entrance"]
    assert fit([], sorted(start.weights), np.zeros(0), start=start) == start
