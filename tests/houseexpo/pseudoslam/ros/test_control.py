"""The services that control a simulation, over a graph that only records."""

from __future__ import annotations

import math
import re
from typing import Any

import pytest

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.io.ros_messages import FIELDS, empty_fields, heading_from_quaternion
from houseexpo.pseudoslam.ros import node as node_module
from houseexpo.pseudoslam.ros.fleet import Fleet
from houseexpo.pseudoslam.ros.node import Node, NodeConfig
from tests.houseexpo.pseudoslam.ros.test_requests import CONFIG, HALL, OTHER, Recorded, drive, made

OK, UNSUPPORTED, NOT_FOUND, FAILED, INVALID_POSE, ALREADY = 1, 0, 2, 4, 101, 101
REQUEST = "simulation_interfaces/srv/SetEntityState_Request"


def others(name: str) -> Fleet:
    if name != "other":
        raise ConfigError(f"house {name!r}: there is no such plan")
    return Fleet(OTHER, CONFIG, starts=[(1.0, 1.0, 0.0)])


def asked(graph: Recorded, node: Node, service: str, **fields: Any) -> dict[str, Any]:
    """Return the answer that comes with the next tick."""
    answers = graph.call(service, **fields)
    node.tick()
    (answer,) = answers
    return answer


def state(x: float = 0.0, y: float = 0.0, heading: float = 0.0, **given: Any) -> dict[str, Any]:
    found = empty_fields(REQUEST) | {"entity": "robot", "set_pose": True} | given
    found["state"]["pose"] = {
        "position": {"x": x, "y": y, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(heading / 2), "w": math.cos(heading / 2)},
    }
    return found


def test_every_service_answers_with_all_fields_of_its_type() -> None:
    graph, node = made(NodeConfig(stepped=True), house=others)
    kinds = {
        "reset": "std_srvs/srv/Empty", "load_map": "nav_msgs/srv/LoadMap", **{
            name: f"simulation_interfaces/srv/{''.join(word.title() for word in name.split('_'))}"
            for name in ("reset_simulation", "load_world", "set_entity_state", "get_entity_state",
                         "set_simulation_state", "get_simulation_state", "get_simulator_features", "step_simulation")
        },
    }  # fmt: skip
    assert {f"/houseexpo/{name}" for name in kinds} == set(graph.services)
    for name, kind in kinds.items():
        found = asked(graph, node, name, **empty_fields(f"{kind}_Request"))
        assert found.keys() == FIELDS[f"{kind}_Response"].keys(), name


def test_an_entity_is_put_and_its_state_is_the_true_one() -> None:
    graph, node = made()
    assert asked(graph, node, "set_entity_state", **state(5.0, 1.0, 0.7))["result"]["result"] == OK
    drive(graph, 0.5)
    node.tick()
    found = asked(graph, node, "get_entity_state", entity="robot")
    x, y, heading = node.fleet.pose(0)
    position, twist = found["state"]["pose"]["position"], found["state"]["twist"]
    assert found["state"]["header"]["frame_id"] == "map"
    assert (position["x"], position["y"]) == pytest.approx((x, y), abs=0.011)  # one tick further
    assert (
        heading_from_quaternion(found["state"]["pose"]["orientation"]) == pytest.approx(heading) == pytest.approx(0.7)
    )
    assert (twist["linear"]["x"], twist["linear"]["y"]) == pytest.approx((0.5 * math.cos(0.7), 0.5 * math.sin(0.7)))


def test_a_velocity_in_the_map_moves_the_entity_that_way() -> None:
    graph, node = made()
    request = state(set_pose=False, set_twist=True)
    request["state"]["twist"]["linear"]["y"] = 0.4
    assert asked(graph, node, "set_entity_state", **request)["result"]["result"] == OK
    for _ in range(24):
        node.tick()
    assert node.fleet.pose(0)[:2] == pytest.approx((2.0, 2.0 + 25 * 0.02 * 0.4), abs=1e-6)


@pytest.mark.parametrize(
    ("request_", "number", "text"),
    [
        (state(2.0, 2.0, entity="dog"), NOT_FOUND, "expected one of robot, found 'dog'"),
        (state(9.0, 1.0), INVALID_POSE, r"does not fit at \(9, 1\) m"),
        (state(math.nan, 1.0), INVALID_POSE, "expected finite numbers"),
    ],
)
def test_what_an_entity_cannot_be_is_answered(request_: dict[str, Any], number: int, text: str) -> None:
    graph, node = made()
    found = asked(graph, node, "set_entity_state", **request_)["result"]
    assert found["result"] == number
    assert re.search(text, found["error_message"])
    assert node.fleet.pose(0) == (2.0, 2.0, 0.5)


def test_a_quaternion_of_another_length_and_another_frame_are_refused() -> None:
    graph, node = made()
    request = state(5.0, 1.0)
    request["state"]["pose"]["orientation"]["w"] = 0.0
    assert asked(graph, node, "set_entity_state", **request)["result"]["result"] == INVALID_POSE
    request = state(5.0, 1.0)
    request["state"]["header"]["frame_id"] = "odom"
    assert "frame 'map', found 'odom'" in asked(graph, node, "set_entity_state", **request)["result"]["error_message"]


@pytest.mark.parametrize(("scope", "moved_back", "time_s"), [(0, True, 1.02), (2, True, 1.1), (1, False, 1.02)])
def test_a_reset_sets_back_what_its_scope_says(scope: int, moved_back: bool, time_s: float) -> None:
    graph, node = made()
    for _ in range(4):
        drive(graph, 0.5)
        node.tick()
    assert asked(graph, node, "reset_simulation", scope=scope)["result"]["result"] == OK
    assert (node.fleet.pose(0) == (2.0, 2.0, 0.5)) == moved_back
    assert node.now_s == pytest.approx(time_s)


def test_after_a_jump_of_the_clock_all_goes_on_as_at_the_start() -> None:
    graph, node = made(NodeConfig(scan_hz=10.0))
    for _ in range(203):
        node.tick()
    drive(graph, 0.2)
    node.tick()
    graph.call("reset_simulation", scope=1)
    before = {topic: len(messages) for topic, messages in graph.heard.items()}
    for _ in range(100):
        drive(graph, 0.2)
        node.tick()
    assert len(graph.heard["/scan"]) - before["/scan"] == 21
    seconds = [fields["clock"]["sec"] + fields["clock"]["nanosec"] / 1e9 for fields in graph.heard["/clock"]]
    assert min(seconds[before["/clock"] :]) == 1.0
    assert math.dist(node.fleet.pose(0)[:2], (2.0, 2.0)) == pytest.approx(0.2 * 100 * 0.02, abs=1e-6)


def test_nothing_can_be_despawned() -> None:
    graph, node = made()
    assert asked(graph, node, "reset_simulation", scope=4)["result"]["result"] == UNSUPPORTED


def test_another_house_by_both_services() -> None:
    graph, node = made(house=others)
    found = asked(graph, node, "load_map", map_url="other")
    assert found["result"] == 0
    assert (found["map"]["info"]["width"], found["map"]["info"]["height"]) == (
        node.house_map().fields["info"]["width"],
    ) * 2
    assert asked(graph, node, "load_map", map_url="nowhere")["result"] == 1
    graph, node = made(house=others)
    resource = {"uri": "other", "resource_string": ""}
    found = asked(graph, node, "load_world", world_resource=resource)
    assert (found["result"]["result"], found["world"]["name"], node.fleet.plan.id) == (OK, "other", "other")
    assert asked(graph, node, "get_simulation_state")["state"] == {"state": 0}  # the standard's: stopped
    found = asked(graph, node, "load_world", world_resource={"uri": "nowhere", "resource_string": ""})
    assert (found["result"]["result"], node.fleet.plan.id) == (NOT_FOUND, "other")
    assert (
        asked(graph, node, "load_world", world_resource={"uri": "", "resource_string": ""})["result"]["result"] == 102
    )


def test_steps_are_answered_when_they_are_done(monkeypatch: pytest.MonkeyPatch) -> None:
    graph, node = made(NodeConfig(stepped=True))
    answers: list[list[dict[str, Any]]] = []
    acts = iter(
        [
            lambda: answers.append(graph.call("step_simulation", steps=5)),
            lambda: answers.append(graph.call("step_simulation", steps=3)),
            lambda: answers.append(graph.call("set_simulation_state", state={"state": 2})),
            lambda: answers.append(graph.call("set_simulation_state", state={"state": 0})),
            lambda: answers.append(graph.call("step_simulation", steps=3)),
        ]
    )

    def wait(_seconds: float) -> None:
        act = next(acts, None)
        if act is None:
            raise KeyboardInterrupt
        act()

    monkeypatch.setattr(node_module.time, "sleep", wait)
    with pytest.raises(KeyboardInterrupt):
        node.run()
    assert [answer["result"]["result"] for (answer,) in answers] == [OK, OK, ALREADY, OK, FAILED]
    assert node.elapsed_s == pytest.approx(8 * 0.02)
    assert node.now_s == 1.0  # it was stopped at last


def test_steps_that_a_reset_cuts_short_are_answered_too() -> None:
    _, node = made(NodeConfig(stepped=True))
    came: list[bool] = []
    node.step(5, came.append)
    node.reset()
    assert came == [False]


def test_a_graph_without_other_houses_says_so() -> None:
    graph, node = made()
    assert asked(graph, node, "load_map", map_url="x")["result"] == 1
    assert "there is only one house" in graph.events[-1]
    assert node.fleet.plan is HALL
