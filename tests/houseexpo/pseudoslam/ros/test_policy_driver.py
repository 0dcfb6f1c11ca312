"""A policy drives a robot of ``houseexpo ros`` as it drives in the benchmark, and gives way to a person."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from houseexpo.errors import ConfigError, PolicyError
from houseexpo.pseudoslam.agents.loading import NamedPolicy, load_policy
from houseexpo.pseudoslam.agents.protocol import Interface
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import EpisodeRunner
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig
from houseexpo.pseudoslam.ros.fleet import Fleet, Velocity
from houseexpo.pseudoslam.ros.node import Node, NodeConfig
from houseexpo.pseudoslam.ros.policy_driver import TRACK, PolicyDriver, check_interface, first_pose
from tests.builders.browsing import two_rooms
from tests.builders.policies import Continuous, always, named, not_a_number
from tests.houseexpo.pseudoslam.ros.test_requests import Recorded

SEED, TWIST = 5, "geometry_msgs/msg/Twist"


def drawn_by_seed(robot: Any, seed: int) -> Any:
    """Acts by the seed of the policy alone."""
    del robot
    rng = np.random.default_rng(seed)
    return lambda _observation, info: None if info["steps"] == 60 else int(rng.integers(3))


def fleet_of(**changes: Any) -> Fleet:
    config = replace(TRACK.config, **changes)
    return Fleet(two_rooms(), config, starts=[first_pose(two_rooms(), config, SEED)], seed=SEED, tick_s=0.02)


def driver_of(policy: NamedPolicy, fleet: Fleet, **given: Any) -> PolicyDriver:
    return PolicyDriver(policy, fleet, 0, seed=SEED, step_s=TRACK.config.step_s, **given)


def rollout(policy: NamedPolicy) -> tuple[list[tuple[float, ...]], float]:
    """The poses after each step of the benchmark's episode, and what was seen."""
    runner, poses = EpisodeRunner(TRACK, policy, [two_rooms()]), []
    stepped = runner.env.step

    def step(action: Any) -> Any:
        found = stepped(action)
        poses.append(runner.env.simulator.pose(runner.env.state))
        return found

    runner.env.step = step  # type: ignore[method-assign]
    coverage = runner.run(Case("two_rooms", SEED)).values["coverage"]
    assert coverage is not None
    return poses, coverage


POLICIES = [load_policy("frontier"), named(drawn_by_seed), named(Continuous)]


@pytest.mark.parametrize("policy", POLICIES, ids=["frontier", "by-seed", "continuous"])
def test_it_goes_where_it_goes_in_the_benchmark(policy: NamedPolicy) -> None:
    poses, coverage = rollout(policy)
    fleet, said = fleet_of(), list[str]()
    driver = driver_of(policy, fleet, say=said.append)
    steps = min(len(poses), 60)
    for step in range(steps):
        velocities = [driver.velocity()]
        while driver._velocities:
            velocities.append(driver.velocity())
        assert len(velocities) == 25 or policy.name == "mine"  # of 0.5 s
        for velocity in velocities:
            fleet.advance([velocity])
        assert fleet.pose(0) == pytest.approx(poses[step], abs=1e-6)
    if steps == len(poses):
        driver.velocity()
        assert driver.is_done
        assert driver.coverage == pytest.approx(coverage, abs=1e-4)
        assert said[0].startswith(f"robot 1: policy {policy.name!r} is done: {coverage:.1%} seen in {steps} steps, ")
        assert driver.velocity() == Velocity()


def node_of(fleet: Fleet, policy: NamedPolicy) -> tuple[Recorded, Node]:
    graph = Recorded()
    return graph, Node(
        graph, fleet, NodeConfig(maps="slam"), drivers=lambda fleet, say: [driver_of(policy, fleet, say=say)]
    )


def test_a_person_takes_over_and_the_policy_goes_on_from_there() -> None:
    fleet = fleet_of()
    graph, node = node_of(fleet, load_policy("frontier"))
    for _ in range(40):
        node.tick()
    assert ("/cmd_vel", TWIST) not in graph._inward  # it would hear itself
    heading = fleet.pose(0)[2]
    turned = {"linear": {"x": 0.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 1.0}}
    for _ in range(10):
        graph.send("/cmd_vel_teleop", TWIST, **turned)
        node.tick()
        assert graph.heard["/cmd_vel"][-1]["angular"]["z"] == 1.0
    for _ in range(50):  # until the last command is a second old
        node.tick()
    assert math.remainder(fleet.pose(0)[2] - heading - 60 * 0.02, math.tau) == pytest.approx(0.0, abs=0.03)
    while not node.drivers[0].is_done:
        node.tick()
        assert node.now_s < 200.0
    assert "is done: 99" in graph.events[-1]
    known = np.array(graph.heard["/map"][-1]["data"])
    assert set(np.unique(known)) == {-1, 0, 100}


def test_a_reset_begins_the_episode_again() -> None:
    fleet = fleet_of()
    graph, node = node_of(fleet, named(drawn_by_seed))
    ways = []
    for _ in range(2):
        first = len(graph.heard["/cmd_vel"])
        for _ in range(200):
            node.tick()
        ways.append(graph.heard["/cmd_vel"][first:])
        node.reset()
    assert ways[0] == ways[1]


@pytest.mark.slow
def test_it_sees_people_and_explores_among_them() -> None:
    fleet = fleet_of(people=PeopleConfig(2))
    driver = driver_of(load_policy("frontier"), fleet)
    for _ in range(20_000):
        fleet.advance([driver.velocity()])
        if driver.is_done:
            break
    assert driver.coverage >= 0.98


def test_what_cannot_drive_is_refused_and_what_fails_is_said() -> None:
    with pytest.raises(ConfigError, match=r"expected one that explores, found one for navigation"):
        check_interface(load_policy("a-star"))

    class Frontiers(Continuous):
        interface = Interface(actions="frontier")

    with pytest.raises(ConfigError, match=r"actions are turns and ways .*, found 'frontier'"):
        check_interface(named(Frontiers))
    with pytest.raises(PolicyError, match=r"policy 'mine': plan 'two_rooms', step 0: .*expected"):
        driver_of(named(always("ahead")), fleet_of()).velocity()
    with pytest.raises(PolicyError, match=r"plan 'two_rooms', step 0: expected a test to be a factory"):
        driver_of(named(lambda _robot, _seed: None), fleet_of())  # type: ignore[arg-type, return-value]
    fleet = fleet_of()
    driver = driver_of(named(not_a_number), fleet)

    def drive() -> None:
        for _ in range(200):
            fleet.advance([driver.velocity()])

    with pytest.raises(PolicyError, match=r"step 4: "):
        drive()
