"""Which plans episodes take: of a list of ids, at random or in turn."""

from __future__ import annotations

import copy
import pickle
from collections import Counter
from typing import Any

import gymnasium
import numpy as np
import pytest

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig
from tests.builders.simulations import HUTS, hut, native

SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0), max_steps=4)
MANY = [*HUTS, hut("huge", 7.0), hut("tiny", 2.5)]
IDS = ["tiny", "large", "small", "huge"]


def one(**given: Any) -> gymnasium.Env:
    return gymnasium.make("PseudoSLAM/Exploration-v0", **{"dataset": MANY, "config": SMALL, **given}).unwrapped


def several(number: int, mode: str, **given: Any) -> Any:
    return native("Exploration", number, mode, **{"dataset": MANY, "config": SMALL, **given})


def test_in_turn_each_plan_comes_once_and_then_again() -> None:
    env = one(plan_ids=IDS, plan_order="in_turn")
    seen = [env.reset(seed=3)[1]["plan_id"], *(env.reset()[1]["plan_id"] for _ in range(5))]
    assert seen == [*IDS, *IDS[:2]]
    assert env.reset(seed=3)[1]["plan_id"] == IDS[0]  # a seed begins anew
    assert env.reset(options={"plan_id": "middle"})[1]["plan_id"] == "middle"  # whose turn it is not
    assert env.reset()[1]["plan_id"] == IDS[1]


def test_at_random_only_those_of_the_list_come() -> None:
    env = one(plan_ids=("small", "huge"))
    seen = Counter(env.reset(seed=seed)[1]["plan_id"] for seed in range(40))
    assert set(seen) == {"small", "huge"}
    assert min(seen.values()) > 8


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_environments_take_from_one_list(mode: str) -> None:
    """Three of them, four plans: each has one, the fourth goes to the first that ends, and then it begins anew."""
    env = several(3, mode, plan_ids=IDS, plan_order="in_turn", success_coverage=None)
    begun = env.reset(seed=0)[1]["plan_id"].tolist()
    assert begun == IDS[:3]
    for _ in range(5):
        *_, infos = env.step(np.zeros(3, np.int64))
    assert infos["plan_id"].tolist() == [IDS[3], *IDS[:2]]


def test_all_plans_of_the_data_set_come_in_turn_where_no_list_is_given() -> None:
    env = several(5, "NextStep", plan_order="in_turn")
    assert env.reset(seed=0)[1]["plan_id"].tolist() == [plan.id for plan in MANY]


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])  # noqa: S301
def test_a_copy_goes_on_in_turn_and_leaves_the_first_alone(copied: Any) -> None:
    env = one(plan_ids=IDS, plan_order="in_turn")
    env.reset(seed=0)
    other = copied(env)
    assert [other.reset()[1]["plan_id"] for _ in range(2)] == IDS[1:3]
    assert env.reset()[1]["plan_id"] == IDS[1]
    other.plan_ids = ["middle"]
    assert other.reset()[1]["plan_id"] == "middle"
    assert env.plan_ids == IDS


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"plan_ids": ["small", "none"]}, "plan_ids: none of the 5 plans has the id 'none'"),
        ({"plan_ids": ["smal"]}, "none of the 5 plans has the id 'smal'; the nearest is 'small'"),
        ({"plan_ids": "train"}, r"found 'train'; open_dataset\(\.\.\.\)\.split\(NAME\)\.ids gives those of a list"),
        ({"plan_ids": []}, "plan_ids: expected at least one id, found none; leave it out to take all plans"),
        ({"plan_ids": "small"}, "plan_ids: expected a list of plans' ids or None .all., found 'small'"),
        ({"plan_ids": 3}, "found 3"),
        ({"plan_order": "sorted"}, "plan_order: expected one of random, in_turn; found 'sorted'"),
    ],
)
def test_what_is_no_list_of_plans_is_refused(given: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        one(**given)
