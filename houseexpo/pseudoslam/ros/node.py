"""Publish simulated robots' topics and take their commands, in place of Gazebo, as nav2's loopback simulator does.

Each robot, in its namespace if there are several:

=================  ==============================================  ===============================================
topic              type                                            what
=================  ==============================================  ===============================================
``cmd_vel`` in     Twist, TwistStamped                             velocity; stops when none came for a second
                                                                   (out if a policy drives, which ``cmd_vel_teleop``,
                                                                   in, overrules)
``initialpose`` in PoseWithCovarianceStamped                       puts the robot there
``odom`` out       Odometry                                        by the wheels, with their noise
``scan`` out       LaserScan                                       in the frame of the laser
``map`` out        OccupancyGrid, latched                          the robot's map, or the house, if asked for
``tf`` out         TFMessage                                       ``map`` to ``odom`` to ``base_footprint``
``tf_static`` out  TFMessage, latched                              ``base_footprint`` to ``base_link`` and the laser
=================  ==============================================  ===============================================

For all robots: ``/clock`` (Clock) out; ``/houseexpo/reset`` (Empty), ``/houseexpo/house`` (String: the id of another
plan) and, while time is paused, ``/houseexpo/step`` (UInt32: ticks to go on) in; ``/houseexpo/event`` (String) out,
which says what came of them.

``map`` to ``odom`` is exact: it is the localisation of a SLAM that never fails.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Final, Literal, TypeAlias

import numpy as np

from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.exports.rasters import FREE, WALL, occupancy_picture
from houseexpo.pseudoslam.io.poses import Pose, compose_poses, relative_pose
from houseexpo.pseudoslam.io.ros_messages import (
    BASE,
    NANOSECONDS,
    RANGE_MIN_M,
    SCAN,
    START_NS,
    TOPICS,
    Fields,
    Message,
    TopicQuality,
    beam_directions,
    clock_message,
    fixed_frames_message,
    heading_from_quaternion,
    laser_scan_message,
    occupancy_grid_message,
    odometry_message,
    transforms_message,
    velocity_message,
)
from houseexpo.pseudoslam.ros.dds import Participant, Subscription
from houseexpo.pseudoslam.ros.fleet import Fleet, Velocity
from houseexpo.pseudoslam.ros.policy_driver import PolicyDriver
from houseexpo.pseudoslam.simulator import OccupancyGrid
from houseexpo.pseudoslam.worlds.maps import MapHouse

Maps = Literal["none", "slam", "house"]
Drivers: TypeAlias = Callable[[Fleet, Callable[[str], None]], Sequence[PolicyDriver]]

COMMANDS: Final = ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped")
"""The types of velocities that are heard; those of a policy are the first."""
EVENTS: Final = "/houseexpo/event"
"""The topic of events; it also shows that a simulator is present."""

_STALE_S: Final = 1.0
"""The time without a velocity after which a robot stops, seconds, as in nav2's loopback simulator."""
_BEHIND_S: Final = 0.5
"""The delay after which the simulation no longer tries to catch up with the wall clock, seconds."""
_PAUSE_S: Final = 0.002
"""The time between two checks for requests while time is paused, seconds."""
_MAP_S: Final = 1.0
_STEPS_MOST: Final = 1_000_000
"""The most ticks that one request may ask for."""
_FASTEST_M_S, _FASTEST_RAD_S = 10.0, 30.0
"""The highest velocities; higher velocities are refused as mistakes."""


@dataclass(frozen=True)
class NodeConfig:
    """How the robots appear in the graph.

    Parameters
    ----------
    scan_hz
        Scans a second of simulated time.
    range_min_m
        The shortest range that a scan reports.
    maps
        What ``map`` has: nothing, the map that each robot makes, or the whole house.
    speed
        Simulated seconds per second; infinite for as fast as possible.
    stepped
        Whether time is paused at the beginning: it goes on by the ticks that are asked for.
    wall_time
        Whether stamps are the wall clock's, and ``/clock`` is silent, for programs without ``use_sim_time``.
    static
        Whether to publish ``tf_static``; not beside a robot_state_publisher.
    localised
        Whether to publish ``map`` to ``odom``; not beside a SLAM or a localisation, which do.
    base, scan
        Frames of the robot and of its laser.
    """

    scan_hz: float = 10.0
    range_min_m: float = RANGE_MIN_M
    maps: Maps = "none"
    speed: float = 1.0
    stepped: bool = False
    wall_time: bool = False
    static: bool = True
    localised: bool = True
    base: str = BASE
    scan: str = SCAN

    def __post_init__(self) -> None:
        if not (math.isfinite(self.scan_hz) and self.scan_hz > 0):
            raise ConfigError(f"scan-hz: expected a number above 0, found {self.scan_hz:g}")
        if not self.speed > 0:
            raise ConfigError(f"speed: expected a number above 0, or inf, found {self.speed:g}")
        if self.stepped and self.wall_time:
            raise ConfigError("stepped: time that is stepped cannot be the wall clock's; leave --wall-time out")


@dataclass(eq=False)
class _Endpoints:
    """One robot's topics, and its latest commands."""

    prefix: str
    hears: str
    """The topic of commands."""
    commands: tuple[Subscription, ...]
    placed: Subscription
    velocity: Velocity = field(default_factory=Velocity)
    told_s: float = -math.inf


class Node:
    """The robots of a fleet in a graph. ``tick`` goes on by one tick, ``run`` goes on in time.

    Parameters
    ----------
    house
        Called with a plan's id; returns the fleet in that house, or raises HouseExpoError.
    drivers
        Called with a fleet whenever an episode begins, and with ``tell``; returns the policy that drives each robot.
        Then ``cmd_vel`` is what the robots do; who drives one by ``cmd_vel_teleop`` has it until a second after the
        last command.
    say
        Called with a sentence about what happened.
    """

    def __init__(
        self,
        graph: Participant,
        fleet: Fleet,
        config: NodeConfig,
        *,
        house: Callable[[str], Fleet] | None = None,
        drivers: Drivers | None = None,
        say: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._graph, self.fleet, self._config, self._house, self._say = graph, fleet, config, house, say
        self._make_drivers = drivers
        self._tick_ns = round(fleet.tick_s * NANOSECONDS)
        self._now_ns = START_NS
        self._next_scan_ns = self._next_map_ns = self._now_ns
        self._angles = beam_directions(fleet.config.laser)
        self.names = ["robot"] if len(fleet) == 1 else [f"robot{k + 1}" for k in range(len(fleet))]
        self._ends = [self._endpoints(f"/{name}" if len(fleet) > 1 else "") for name in self.names]
        self._reset = graph.subscribe("/houseexpo/reset", "std_msgs/msg/Empty")
        self._chosen = graph.subscribe("/houseexpo/house", "std_msgs/msg/String")
        self._steps = graph.subscribe("/houseexpo/step", "std_msgs/msg/UInt32")
        self._ticks = self._due = 0
        graph.advertise(EVENTS, "std_msgs/msg/String", TopicQuality())
        if not config.wall_time:
            self._advertise("", "clock")
        self._published_map: list[bytes] = [b""] * len(self._ends)
        self.drivers = self._start_drivers()
        self._report()

    @property
    def now_s(self) -> float:
        """The simulated time, seconds; it starts at 1."""
        return self._now_ns / NANOSECONDS

    @property
    def elapsed_s(self) -> float:
        """All simulated time since the start, seconds."""
        return self._ticks * self.fleet.tick_s

    @property
    def stamp_ns(self) -> int:
        """The time stamp of messages now, nanoseconds."""
        return time.time_ns() if self._config.wall_time else self._now_ns

    def run(self, seconds: float = math.inf, *, until: Callable[[], bool] = lambda: False) -> None:
        """Go on until so many simulated seconds have passed, or ``until`` returns True.

        If the machine is too slow or was suspended, time goes on more slowly instead of in jumps.
        """
        ends_s = self.elapsed_s + seconds
        due = time.monotonic()
        while self.elapsed_s < ends_s and not until():
            self._graph.look()
            if self._due == 0 and self._config.stepped:
                self._listen()
                due = time.monotonic()
                if self._due == 0:
                    time.sleep(_PAUSE_S)
                continue
            self.tick()
            if self._due > 0:
                self._due -= 1
                continue
            due += self.fleet.tick_s / self._config.speed
            wait = due - time.monotonic()
            if wait > 0:
                time.sleep(wait)
            elif wait < -_BEHIND_S:
                due = time.monotonic()

    def tick(self) -> None:
        """Carry out the requests, simulate one tick, and publish."""
        self._listen()
        now_s = self.now_s
        for k, end in enumerate(self._ends):
            driver = self.drivers[k] if self.drivers else None
            if now_s - end.told_s > _STALE_S:
                end.velocity = driver.velocity() if driver else Velocity()
            elif driver:
                driver.give_way()
            if driver:
                self._send_velocity(end)
        self.fleet.advance([end.velocity for end in self._ends])
        self._now_ns += self._tick_ns
        self._ticks += 1
        self._report()

    def reset(self) -> None:
        """Set the robots, people and maps back to their start; time goes on."""
        self.fleet.reset()
        self._begin_again("reset")
        self._report()

    def move_to_house(self, plan_id: str) -> None:
        """Move to another house; time goes on. Raise HouseExpoError if the house does not exist."""
        if self._house is None:
            raise ConfigError("there is only one house; start with a data set to choose others")
        self.fleet = self._house(plan_id)
        self._begin_again(f"house {plan_id}")

    def place(self, robot: int, pose: Pose) -> None:
        """Put a robot at a pose of the map; ConfigError if it does not fit there."""
        self.fleet.place(robot, pose)
        self._ends[robot].velocity = Velocity()  # it was meant for the other place
        self.publish_and_log(f"robot {robot + 1} was put at ({pose[0]:.2f}, {pose[1]:.2f}) m")

    def drive(self, robot: int, velocity: Velocity) -> None:
        """Give a robot a velocity, as ``cmd_vel`` does; ConfigError if it is too high or no number."""
        ahead, left, turning = velocity.ahead_m_s, velocity.left_m_s, velocity.turn_rad_s
        if not all(map(math.isfinite, (ahead, left, turning))):
            raise ConfigError("a velocity that is no number was passed over")
        if math.hypot(ahead, left) > _FASTEST_M_S or abs(turning) > _FASTEST_RAD_S:
            raise ConfigError(
                f"expected at most {_FASTEST_M_S:g} m/s and {_FASTEST_RAD_S:g} rad/s, "
                f"found {ahead:g} and {left:g} m/s, {turning:g} rad/s; it was passed over"
            )
        self._ends[robot].velocity, self._ends[robot].told_s = velocity, self.now_s

    def _advertise(self, prefix: str, name: str) -> None:
        topic = TOPICS[name]
        self._graph.advertise(f"{prefix}/{name}", topic.kind, topic.quality)

    def _endpoints(self, prefix: str) -> _Endpoints:
        graph = self._graph
        for name in ("odom", "scan", "tf"):
            self._advertise(prefix, name)
        if self._config.maps != "none":
            self._advertise(prefix, "map")
        if self._config.static:
            self._advertise(prefix, "tf_static")
            graph.publish(f"{prefix}/tf_static", fixed_frames_message(self._config.base, self._config.scan))
        hears = f"{prefix}/cmd_vel"
        if self._make_drivers:
            graph.advertise(hears, COMMANDS[0], TopicQuality())
            hears = f"{prefix}/cmd_vel_teleop"
        commands = tuple(graph.subscribe(hears, kind) for kind in COMMANDS)
        placed = graph.subscribe(f"{prefix}/initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped")
        return _Endpoints(prefix, hears, commands, placed)

    def _listen(self) -> None:
        """Process received velocities, poses, and requests to the simulation."""
        for k, end in enumerate(self._ends):
            for command in end.commands:
                for message in command.take():
                    twist = message.fields.get("twist", message.fields)
                    self._try(end.hears, partial(self.drive, k, _velocity(twist)))
            for message in end.placed.take():
                self._try(f"{end.prefix}/initialpose", partial(self._put, k, message.fields))
        if self._reset.take():
            self.reset()
        for message in self._chosen.take():
            self._try("/houseexpo/house", partial(self.move_to_house, str(message.fields["data"])))
        for message in self._steps.take():
            self._try("/houseexpo/step", partial(self._step, int(message.fields["data"])))

    def _start_drivers(self) -> Sequence[PolicyDriver]:
        return self._make_drivers(self.fleet, self.publish_and_log) if self._make_drivers else ()

    def _send_velocity(self, end: _Endpoints) -> None:
        self._graph.publish(
            f"{end.prefix}/cmd_vel",
            velocity_message(
                self.stamp_ns, self._config.base, COMMANDS[0],
                (end.velocity.ahead_m_s, end.velocity.left_m_s, end.velocity.turn_rad_s),
            ),
        )  # fmt: skip

    def _step(self, ticks: int) -> None:
        if not self._config.stepped:
            raise ConfigError("expected time that is paused, found time that runs; start with --stepped")
        self._due += min(ticks, _STEPS_MOST)

    def _put(self, robot: int, fields: Fields) -> None:
        frame, pose = fields["header"]["frame_id"], fields["pose"]["pose"]
        if frame not in {"", "map"}:
            raise ConfigError(f"initialpose: expected a pose in the frame 'map', found {frame!r}")
        x, y = float(pose["position"]["x"]), float(pose["position"]["y"])
        heading = heading_from_quaternion(pose["orientation"])
        if not all(map(math.isfinite, (x, y, heading))):
            raise ConfigError(f"initialpose: expected finite numbers, found x {x}, y {y}, heading {heading}")
        self.place(robot, (x, y, heading))

    def _begin_again(self, what: str) -> None:
        self._due = 0
        for end in self._ends:
            end.velocity, end.told_s = Velocity(), -math.inf
        self._published_map = [b""] * len(self._ends)
        self._next_map_ns = self._now_ns
        self.publish_and_log(what)
        self.drivers = self._start_drivers()

    def _try(self, topic: str, act: Callable[[], None]) -> None:
        """Carry out the request of a message; if that is impossible, report the reason and go on."""
        try:
            act()
        except HouseExpoError as error:
            self.publish_and_log(f"{topic}: {error}")

    def publish_and_log(self, text: str) -> None:
        """Publish an event, and log it."""
        self._say(text)
        self._graph.publish(EVENTS, Message("std_msgs/msg/String", {"data": text}))

    def _report(self) -> None:
        """Publish the clock, poses, and the scans and maps that are due."""
        config, graph, fleet = self._config, self._graph, self.fleet
        stamp = self.stamp_ns
        if not config.wall_time:
            graph.publish("/clock", clock_message(stamp))
        scans, maps = self._now_ns >= self._next_scan_ns, self._now_ns >= self._next_map_ns
        if scans:
            self._next_scan_ns += round(NANOSECONDS / config.scan_hz)
        if maps:
            self._next_map_ns += round(_MAP_S * NANOSECONDS)
        for k, end in enumerate(self._ends):
            wheels = fleet.odometry(k)
            moved = fleet.velocity(k)
            frames = [(stamp, "odom", config.base, wheels)]
            if config.localised:
                frames.insert(0, (stamp, "map", "odom", compute_frame_origin(fleet.pose(k), wheels)))
            graph.publish(f"{end.prefix}/tf", transforms_message(frames))
            speed = moved.ahead_m_s, moved.left_m_s, moved.turn_rad_s
            graph.publish(f"{end.prefix}/odom", odometry_message(stamp, "odom", config.base, wheels, speed))
            if scans:
                graph.publish(f"{end.prefix}/scan", self._scan(k, stamp))
            if maps and config.maps != "none":
                self._send_map(k, stamp)

    def _scan(self, robot: int, stamp: int) -> Message:
        config, most_m = self._config, self.fleet.config.laser.range_m
        ranges = self.fleet.scan(robot, self._angles, config.range_min_m, most_m)
        step_rad, scan_s = math.radians(self.fleet.config.laser.resolution_deg), 1.0 / config.scan_hz
        return laser_scan_message(
            stamp, config.scan, ranges, first_rad=float(self._angles[0]), step_rad=step_rad, scan_s=scan_s,
            least_m=config.range_min_m, most_m=most_m,
        )  # fmt: skip

    def _send_map(self, robot: int, stamp: int) -> None:
        """Publish a map that has changed since the last time; a growing one only if somebody listens."""
        if self._config.maps == "slam" and not self._graph.has_subscribers(f"{self._ends[robot].prefix}/map"):
            return
        if self._config.maps == "house":
            grid = _whole(self.fleet)
        else:
            grid = self.drivers[robot].map() if self.drivers else self.fleet.map(robot)
        data = grid.data.tobytes()
        if data != self._published_map[robot]:
            self._published_map[robot] = data
            self._graph.publish(f"{self._ends[robot].prefix}/map", occupancy_grid_message(stamp, "map", grid))


def _velocity(twist: Fields) -> Velocity:
    return Velocity(float(twist["linear"]["x"]), float(twist["linear"]["y"]), float(twist["angular"]["z"]))


def compute_frame_origin(pose: Pose, seen: Pose) -> Pose:
    """Return the pose in the map of a frame in which a robot at ``pose`` has the pose ``seen``."""
    return compose_poses(pose, relative_pose(seen, (0.0, 0.0, 0.0)))


def _whole(fleet: Fleet) -> OccupancyGrid:
    """Return the house as a map, as ``houseexpo export --to ros`` writes it; of a map, its free and other cells."""
    if isinstance(fleet.plan, MapHouse):
        cells = np.where(fleet.plan.occupied[::-1] != 0, 100, 0).astype(np.int8)
        return OccupancyGrid(cells, fleet.plan.frame.cell_m, fleet.plan.frame.origin_m)
    cell_m = 1.0 / fleet.config.pixels_per_metre
    pixels, frame = occupancy_picture(fleet.plan, cell_m, cell_m, "world")
    values = np.full(256, -1, np.int8)
    values[[FREE, WALL]] = 0, 100
    return OccupancyGrid(values[pixels[::-1]], frame.cell_m, frame.origin_m)
