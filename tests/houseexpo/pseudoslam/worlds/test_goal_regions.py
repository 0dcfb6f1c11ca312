"""Goals that are a kind of room or furniture, by hand in a flat of two rooms, and against a slow twin."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.plan.room_labels import LABELS
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import Robot, make_knowledge
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner
from houseexpo.pseudoslam.benchmark.tracks import find_track
from houseexpo.pseudoslam.config import GoalConfig, ObservationConfig, SimulatorConfig
from houseexpo.pseudoslam.envs.single import NavigationEnv
from houseexpo.pseudoslam.kernels.mapping import draw_nearest_cells
from houseexpo.pseudoslam.kernels.planning.goal_paths import GOAL_CELL
from houseexpo.pseudoslam.tasks import Navigation
from houseexpo.pseudoslam.worlds.goal_regions import cells_beside
from houseexpo.pseudoslam.worlds.maps import map_house
from tests.builders.simulations import at, flat, hall

FORWARD = 0
CONFIG = replace(Navigation.default, known_map=False)


def to(kind: Any, *names: str, **given: Any) -> SimulatorConfig:
    return replace(CONFIG, goal=GoalConfig(kind=kind, names=names, **given))


def going(config: SimulatorConfig, x_m: float, y_m: float, heading_deg: float) -> tuple[NavigationEnv, Any, Any]:
    env = NavigationEnv(flat(), at(x_m, y_m, heading_deg, config))
    return env, *env.reset(seed=0)


def test_a_robot_is_in_the_kitchen_when_its_centre_is() -> None:
    env, observation, info = going(to("room", "Kitchen"), 6.0, 2.0, 180.0)
    assert info["to_goal_m"] == pytest.approx(2.02, abs=0.021)  # to the first cell within 4 m
    assert set(observation) == {"map", "goal_number", "goal_map"}
    assert env.observation_space.contains(observation)
    assert observation["goal_number"] == 0
    rewards = []
    for step in range(1, 8):
        _, reward, terminated, _, info = env.step(FORWARD)
        rewards.append(reward)
        assert terminated == info["is_success"] == (step == 7)
        assert info["pose"][0] == pytest.approx(6.0 - 0.3 * step)
    assert info["to_goal_m"] == 0.0
    assert info["spl"] == pytest.approx(2.02 / 2.1, abs=0.01)
    assert sum(rewards) == pytest.approx(2.02 + 2.5, abs=0.021)


def test_a_robot_is_at_the_bed_within_a_metre_and_in_sight_of_it() -> None:
    _, _, info = going(to("object", "bed"), 4.7, 3.0, 0.0)
    assert info["to_goal_m"] == pytest.approx(6.5 - 1.0 - 4.7, abs=0.041)
    _, _, info = going(to("object", "bed"), 5.7, 3.0, 180.0)  # with its back to the bed
    assert (info["to_goal_m"], info["spl"], info["is_success"]) == (0.0, 1.0, True)


def test_the_nearest_kind_that_is_far_enough_is_drawn() -> None:
    for least_m, wanted in ((0.5, {"Kitchen"}), (9.0, {"Kitchen"}), (0.0, {"Kitchen", "Bedroom"})):
        env = NavigationEnv(flat(), at(6.0, 1.0, 0.0, to("room", least_way_m=least_m)))
        found = set()
        for seed in range(12):
            observation, _ = env.reset(seed=seed)
            found.add(LABELS[observation["goal_number"]])
        assert found == wanted


def test_a_policy_is_told_the_kind_and_what_it_sees_of_it() -> None:
    for heading_deg, sees in ((180.0, True), (0.0, False)):
        env, _, _ = going(to("room", "kitchen"), 6.0, 2.0, heading_deg)
        info = make_knowledge(env.simulator, env.state)
        assert "goal_px" not in info
        assert info["goal_name"] == "Kitchen"
        rows, cols = np.nonzero(info["goal_map"])
        assert (len(rows) > 0) == sees
        assert (info["map"][rows, cols] != 0).all()
        assert (env.simulator.world.frame.points_from_pixels(np.stack([cols, rows], 1) + 0.5)[:, 0] < 4.0).all()
        np.testing.assert_array_equal(info["room_map"] == 1 + LABELS.index("Kitchen"), info["goal_map"] != 0)
        assert not info["room_map"][info["map"] == 0].any()


@pytest.mark.parametrize("pixels", [None, 32])
def test_the_view_of_the_goal_is_that_of_the_known_cells_of_its_region(pixels: int | None) -> None:
    config = replace(to("room", "Kitchen"), observation=ObservationConfig(6.0, pixels=pixels))
    env, observation, _ = going(config, 5.0, 2.0, 170.0)
    for action in (0, 1, 0, 2, 2, 0):
        state = env.state
        region = state.episode.paths.standing.reshape(state.known.shape) == GOAL_CELL
        x, y, heading = state.believed_px.tolist()
        slow = np.empty_like(observation["goal_map"][0])
        masked = np.where(region & (state.known != 0), 255, 0).astype(np.uint8)
        draw_nearest_cells(masked, x, y, math.cos(heading), math.sin(heading), 150.0 / len(slow), slow)
        assert slow.any()
        np.testing.assert_array_equal(observation["goal_map"], slow[None])
        assert observation["goal_map"].shape == observation["map"].shape
        observation = env.step(action)[0]


@pytest.mark.parametrize("kind", ["room", "object"])
def test_policies_find_it(kind: str) -> None:
    track = find_track(f"{kind}goal")
    for name, most in (("shortest", 1.1), ("seek", 3.0), ("seek-likely", 3.0)):
        runner = EpisodeRunner(track, load_policy(name), [flat()])
        for seed in range(6):
            values = runner.run(Case("flat", seed)).values
            assert values["success"] == 1.0
            shortest_m = runner.env.state.shortest_path_m
            assert shortest_m - 0.02 < (values["metres"] or 0.0) < most * shortest_m + 0.3, (name, seed, values)


def test_cells_beside_what_is_marked_are_those_of_its_twin() -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        blocked = (rng.random((30, 40)) < 0.1).astype(np.uint8)
        marked = np.zeros_like(blocked)
        marked[10:14, 18:25] = 1
        found = cells_beside(marked, blocked | marked, 9.0)
        places = np.argwhere(marked)
        for row, col in np.argwhere((blocked | marked) == 0).tolist():
            away = np.hypot(*(places - (row, col)).T)
            if abs(away.min() - 9.0) < 0.5:
                continue  # cv2's distances are a little rounded
            lines = [
                [(round(row + s * (r - row)), round(col + s * (c - col))) for s in np.linspace(0, 1, 19)]
                for r, c in places[away < away.min() + 0.5].tolist()
            ]
            free = [not any(blocked[cell] and not marked[cell] for cell in line) for line in lines]
            assert not (found[row, col] and away.min() > 9.0)
            if away.min() < 9.0 and all(free):
                assert found[row, col]
            if not any(free):
                assert not found[row, col]
        assert not found[(blocked | marked) != 0].any()


def test_what_a_house_does_not_have_is_said() -> None:
    with pytest.raises(
        ConfigError, match=r"goal: plan 'flat' has no Garage that a robot can reach; it has Bedroom, Kitchen"
    ):
        NavigationEnv(flat(), to("room", "Garage")).reset(seed=0)
    with pytest.raises(
        ConfigError, match="plan 'flat' has no beds that a robot can reach; it has bed, chair; did you mean"
    ):
        NavigationEnv(flat(), to("object", "beds")).reset(seed=0)
    with pytest.raises(ConfigError, match="it has no objects with names"):
        NavigationEnv(hall(), to("object", "bed")).reset(seed=0)
    house = map_house(np.zeros((40, 40), np.uint8), 0.05)
    with pytest.raises(ConfigError, match="goal: map 'map' has no rooms with names; take a plan"):
        NavigationEnv(house, to("room")).reset(seed=0)
    with pytest.raises(
        ConfigError, match=r"actions='frontier': expected a goal that is a place, found goal.kind='room'"
    ):
        NavigationEnv(flat(), to("room"), actions="frontier")


def test_policies_for_another_kind_of_goal_say_so() -> None:
    for name, track in (("greedy", "roomgoal"), ("a-star", "objectgoal"), ("wait", "roomgoal")):
        with pytest.raises(ConfigError, match=r"goal: this policy expects a place \(goal.kind place\), found "):
            load_policy(name).factory(Robot(find_track(track).config), 0)
    with pytest.raises(ConfigError, match=r"expects a kind of room or furniture .*, found place"):
        load_policy("seek").factory(Robot(find_track("pointgoal").config), 0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"kind": "rooms"}, "goal.kind: expected one of place, room, object; found 'rooms'"),
        ({"kind": "room", "names": "Kitchen"}, "goal.names: expected a list of names, found 'Kitchen'"),
        (
            {"kind": "room", "names": ("Kitchn",)},
            "goal.names: expected labels of rooms .* found 'Kitchn'; did you mean",
        ),
        ({"kind": "room", "names": ("Hall", "Hall")}, "goal.names: expected each name once"),
        ({"kind": "room", "names": ("Living_Room", "living room")}, "goal.names: expected each name once"),
        ({"kind": "object", "names": ("bed", "Bed")}, "goal.names: expected each name once"),
        ({"kind": "object"}, "goal.names: expected the kinds of furniture, such as bed, found none"),
        ({"names": ("Hall",)}, "goal.names: expected none for a place"),
    ],
)
def test_a_wrong_goal_is_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        GoalConfig(**given)


def test_a_goal_of_a_kind_is_written_and_read_back() -> None:
    config = to("room", "living room", "Kitchen")
    assert config.goal is not None
    assert config.goal.names == ("Living_Room", "Kitchen")
    assert SimulatorConfig.from_mapping(config.to_mapping()) == config
    assert math.isclose(config.goal.radius_m, 0.3)
