"""Serve the ROS services by which programs control the simulation through a rosbridge.

Their names are in ``/houseexpo``; types without a package are those of simulation_interfaces 2, the ROS standard for
simulators, whose definitions say what they do:

===========================  ======================  ===================================================================
service                      type                    what
===========================  ======================  ===================================================================
``reset``                    std_srvs/Empty          begins again; time goes on
``load_map``                 nav_msgs/LoadMap        goes to another house, by its id; the answer has its map
``reset_simulation``         ResetSimulation         begins again, with the time, the poses, or both
``load_world``               LoadWorld               goes to another house, ``uri`` is its id; then time is stopped
``set_entity_state``         SetEntityState          puts a robot, or gives it a velocity
``get_entity_state``         GetEntityState          the true pose and velocity of a robot
``set_simulation_state``     SetSimulationState      lets time run, pauses it, or stops it: pause, and begin again
``get_simulation_state``     GetSimulationState      whether time runs
``step_simulation``          StepSimulation          goes on by ticks while time is paused, and answers then
``get_simulator_features``   GetSimulatorFeatures    what of the standard there is
===========================  ======================  ===================================================================

Robots are the entities ``robot``, or ``robot1``, ``robot2`` and so on.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, Protocol, TypeAlias

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.pseudoslam.io.poses import Pose
from houseexpo.pseudoslam.io.ros_messages import (
    Fields,
    Message,
    empty_fields,
    entity_state_message,
    heading_from_quaternion,
)
from houseexpo.pseudoslam.ros.fleet import Fleet, Velocity

Time: TypeAlias = Literal["playing", "paused", "stopped"]

_STATES: Final[dict[int, Time]] = {0: "stopped", 1: "playing", 2: "paused"}
_UNSUPPORTED, _OK, _NOT_FOUND, _INCORRECT_STATE, _FAILED = 0, 1, 2, 3, 4
_INVALID_POSE, _ALREADY, _NO_RESOURCE = 101, 101, 102
_TIME, _STATE, _ALL = 1, 2, 255
_FEATURES: Final = [10, 11, 20, 21, 22, 24, 25, 26, 31, 32, 40]
"""States of entities, resets of time and state, states of the simulation, steps, worlds (SimulatorFeatures)."""
_MAP_UNKNOWN: Final = 1
STEPS_MOST: Final = 1_000_000
"""The most steps that one request may ask for."""
_UNIT: Final = 0.01
"""How far a quaternion's length may be from 1."""

_SIM: Final = "simulation_interfaces/srv"
_CALLS_MOST: Final = 100
"""The most requests of a service that wait; older ones make room."""


@dataclass(eq=False)
class ServiceCall:
    """A request of a service; call ``answer`` once to answer it."""

    fields: Fields
    answer: Callable[[Fields], None]


class RequestQueue:
    """The received requests of a service that have not been taken yet."""

    def __init__(self) -> None:
        self._arrived: deque[ServiceCall] = deque(maxlen=_CALLS_MOST)

    def add(self, call: ServiceCall) -> None:
        """Add a request; called by the network's thread."""
        self._arrived.append(call)

    def take(self) -> list[ServiceCall]:
        """Return the requests since the last call, the oldest first."""
        found = []
        while self._arrived:
            found.append(self._arrived.popleft())
        return found


class ControlledNode(Protocol):
    """What the services need of a node, see ``node.Node``."""

    fleet: Fleet
    names: list[str]
    time: Time

    @property
    def stamp_ns(self) -> int:
        """The time that messages have now, nanoseconds."""

    def reset(self, *, time: bool = False, state: bool = True) -> None:
        """Begin again."""

    def move_to_house(self, plan_id: str) -> None:
        """Go to another house."""

    def house_map(self) -> Message:
        """Return the map of the whole house."""

    def place(self, robot: int, pose: Pose) -> None:
        """Put a robot at a pose of the map."""

    def drive(self, robot: int, velocity: Velocity) -> None:
        """Give a robot a velocity."""

    def set_time(self, time: Time) -> None:
        """Let time run, pause it, or stop it."""

    def step(self, ticks: int, then: Callable[[bool], None]) -> None:
        """Go on by ticks."""

    def publish_and_log(self, text: str) -> None:
        """Publish an event."""


class _NoSuchRobotError(ConfigError):
    """No robot has the name of the entity."""


class ControlServices:
    """The services of a node; ``serve`` answers what was asked since the last time.

    ``offer`` offers a service of a type by its name (``bridge.Bridge``).
    """

    def __init__(self, offer: Callable[[str, str], RequestQueue], node: ControlledNode) -> None:
        self._node = node
        handlers: dict[str, tuple[str, Callable[[Fields], Fields]]] = {
            "reset": ("std_srvs/srv/Empty", self._reset),
            "load_map": ("nav_msgs/srv/LoadMap", self._load_map),
            "reset_simulation": (f"{_SIM}/ResetSimulation", self._reset_simulation),
            "load_world": (f"{_SIM}/LoadWorld", self._load_world),
            "set_entity_state": (f"{_SIM}/SetEntityState", self._set_entity),
            "get_entity_state": (f"{_SIM}/GetEntityState", self._get_entity),
            "set_simulation_state": (f"{_SIM}/SetSimulationState", self._set_state),
            "get_simulation_state": (f"{_SIM}/GetSimulationState", self._get_state),
            "get_simulator_features": (f"{_SIM}/GetSimulatorFeatures", self._features),
        }
        self._served = [(offer(f"/houseexpo/{name}", kind), handler) for name, (kind, handler) in handlers.items()]
        self._steps = offer("/houseexpo/step_simulation", f"{_SIM}/StepSimulation")

    def serve(self) -> None:
        """Answer the requests that arrived."""
        for service, handler in self._served:
            for call in service.take():
                call.answer(handler(call.fields))
        for call in self._steps.take():
            self._step(call)

    def _reset(self, _asked: Fields) -> Fields:
        self._node.reset()
        return empty_fields("std_srvs/srv/Empty_Response")

    def _load_map(self, asked: Fields) -> Fields:
        answer = empty_fields("nav_msgs/srv/LoadMap_Response")
        try:
            self._node.move_to_house(asked["map_url"])
        except HouseExpoError as error:
            self._node.publish_and_log(f"/houseexpo/load_map: {error}")
            return {**answer, "result": _MAP_UNKNOWN}
        return {**answer, "map": self._node.house_map().fields}

    def _reset_simulation(self, asked: Fields) -> Fields:
        scope = asked["scope"] or _ALL
        if not scope & (_TIME | _STATE):
            return _result(_UNSUPPORTED, "only SCOPE_TIME and SCOPE_STATE are supported; nothing can be spawned")
        self._node.reset(time=bool(scope & _TIME), state=bool(scope & _STATE))
        return _result(_OK)

    def _load_world(self, asked: Fields) -> Fields:
        answer, uri = empty_fields(f"{_SIM}/LoadWorld_Response"), asked["world_resource"]["uri"]
        if not uri:
            text = "uri: expected the id of a plan, found none; worlds as text are not supported"
            return {
                **answer,
                **_result(_UNSUPPORTED if asked["world_resource"]["resource_string"] else _NO_RESOURCE, text),
            }
        try:
            self._node.move_to_house(uri)
        except HouseExpoError as error:
            return {**answer, **_result(_NOT_FOUND, str(error))}
        self._node.set_time("stopped")
        answer["world"] |= {"name": uri, "world_resource": {"uri": uri, "resource_string": ""}}
        return {**answer, **_result(_OK)}

    def _set_entity(self, asked: Fields) -> Fields:
        state = asked["state"]
        try:
            robot = self._robot(asked["entity"])
            frame = state["header"]["frame_id"]
            if frame not in {"", "map", "world"}:
                raise ConfigError(f"expected a state in the frame 'map', found {frame!r}")
            pose = _pose(state["pose"]) if asked["set_pose"] else self._node.fleet.pose(robot)
            velocity = _velocity(state["twist"], pose[2]) if asked["set_twist"] else None
            if asked["set_pose"]:
                self._node.place(robot, pose)
            if velocity is not None:
                self._node.drive(robot, velocity)
        except _NoSuchRobotError as error:
            return _result(_NOT_FOUND, str(error))
        except HouseExpoError as error:
            return _result(_INVALID_POSE if asked["set_pose"] else _FAILED, str(error))
        return _result(_OK)

    def _get_entity(self, asked: Fields) -> Fields:
        answer = empty_fields(f"{_SIM}/GetEntityState_Response")
        try:
            robot = self._robot(asked["entity"])
        except _NoSuchRobotError as error:
            return {**answer, **_result(_NOT_FOUND, str(error))}
        pose, moved = self._node.fleet.pose(robot), self._node.fleet.velocity(robot)
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        right, up = moved.ahead_m_s * cos - moved.left_m_s * sin, moved.ahead_m_s * sin + moved.left_m_s * cos
        state = entity_state_message(self._node.stamp_ns, "map", pose, (right, up, moved.turn_rad_s))
        return {**_result(_OK), "state": state.fields}

    def _robot(self, name: str) -> int:
        names = self._node.names
        if name not in names:
            raise _NoSuchRobotError(f"entity: expected one of {', '.join(names)}, found {name!r}")
        return names.index(name)

    def _set_state(self, asked: Fields) -> Fields:
        wanted = _STATES.get(asked["state"]["state"])
        if wanted is None:
            text = f"state: expected 0 (stopped), 1 (playing) or 2 (paused), found {asked['state']['state']}"
            return _result(_UNSUPPORTED, text)
        if wanted == self._node.time:
            return _result(_ALREADY, f"time is {wanted} already")
        self._node.set_time(wanted)
        return _result(_OK)

    def _get_state(self, _asked: Fields) -> Fields:
        number = next(number for number, time in _STATES.items() if time == self._node.time)
        return {"state": {"state": number}, **_result(_OK)}

    def _features(self, _asked: Fields) -> Fields:
        found = {"features": list(_FEATURES), "spawn_formats": [], "custom_info": "houseexpo ros"}
        return {"features": found}

    def _step(self, call: ServiceCall) -> None:
        steps = int(call.fields["steps"])
        if self._node.time != "paused":
            call.answer(_result(_FAILED, f"expected a simulation that is paused, found one that is {self._node.time}"))
        elif not 1 <= steps <= STEPS_MOST:
            call.answer(_result(_FAILED, f"steps: expected a number from 1 to {STEPS_MOST:,}, found {steps:,}"))
        else:
            self._node.step(steps, lambda came: call.answer(_step_result(came)))


def _step_result(came: bool) -> Fields:
    return _result(_OK) if came else _result(_FAILED, "the simulation was reset or played before the steps were done")


def _result(number: int, text: str = "") -> Fields:
    return {"result": {"result": number, "error_message": text}}


def _pose(fields: Fields) -> Pose:
    x, y = float(fields["position"]["x"]), float(fields["position"]["y"])
    length = math.hypot(*(float(fields["orientation"][name]) for name in "xyzw"))
    if not (math.isfinite(x) and math.isfinite(y) and abs(length - 1.0) <= _UNIT):
        raise ConfigError(
            f"pose: expected finite numbers and a unit quaternion, found x {x:g}, y {y:g}, length {length:g}"
        )
    return x, y, heading_from_quaternion(fields["orientation"])


def _velocity(twist: Fields, heading: float) -> Velocity:
    """Return the velocity in the robot's frame of one in the map's."""
    right, up, turn = float(twist["linear"]["x"]), float(twist["linear"]["y"]), float(twist["angular"]["z"])
    cos, sin = math.cos(heading), math.sin(heading)
    return Velocity(right * cos + up * sin, up * cos - right * sin, turn)
