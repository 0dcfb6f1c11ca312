"""``houseexpo ros``: put simulated robots into a running ROS 2 graph, in place of Gazebo."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from houseexpo.commands.arguments import POLICIES, HousesArgument, MapResolution, make_completion
from houseexpo.errors import ConfigError

if TYPE_CHECKING:
    from houseexpo.dataset import Dataset
    from houseexpo.floorplan import FloorPlan
    from houseexpo.pseudoslam.config import SimulatorConfig
    from houseexpo.pseudoslam.io.poses import Pose
    from houseexpo.pseudoslam.worlds.maps import House, MapHouse

_RANGE_M, _RESOLUTION_DEG = 12.0, 1.0
"""A common laser's, if no configuration is given; it looks all round."""


def ros(
    dataset: HousesArgument = None,
    plan: Annotated[str | None, typer.Option(help="Id of the plan.", show_default="the first")] = None,
    resolution: MapResolution = None,
    policy: Annotated[
        str | None,
        typer.Option(
            help="Let a policy drive: a name such as frontier, a file, or module:name. It explores as on the track "
            "quality of the benchmark; cmd_vel_teleop overrules it.",
            show_default="none",
            autocompletion=make_completion(*POLICIES),
        ),
    ] = None,
    robots: Annotated[int, typer.Option(help="Number of robots; several are /robot1, /robot2, ...")] = 1,
    people: Annotated[int | None, typer.Option(help="Number of people who walk.", show_default="none")] = None,
    start: Annotated[
        list[str] | None,
        typer.Option(help="Start 'x,y,degrees' in the plan's frame; once for each robot.", show_default="at random"),
    ] = None,
    laser_noise: Annotated[
        float | None, typer.Option(help="Standard deviation of a range, metres.", show_default="0")
    ] = None,
    odometry_noise: Annotated[
        float | None,
        typer.Option(help="Standard deviation of each step's way and turn, as a share of it.", show_default="0"),
    ] = None,
    maps: Annotated[
        Literal["none", "slam", "house"] | None,
        typer.Option(
            "--map",
            help="Topic map: none, the robot's own map as it grows, or the whole house.",
            show_default="none; slam, with a policy",
        ),
    ] = None,
    speed: Annotated[float, typer.Option(help="Simulated seconds per second; inf: as fast as possible.")] = 1.0,
    stepped: Annotated[
        bool,
        typer.Option("--stepped", help="Begin with time paused: it goes on by /houseexpo/step."),
    ] = False,
    wall_time: Annotated[
        bool, typer.Option("--wall-time", help="Stamps of the wall clock and no /clock, without use_sim_time.")
    ] = False,
    rate: Annotated[float, typer.Option(help="Ticks of simulated time: odom, tf and clock a second.")] = 50.0,
    scan_hz: Annotated[float, typer.Option(help="Scans a second.")] = 10.0,
    base_frame: Annotated[str, typer.Option(help="Frame of the robot.")] = "base_footprint",
    scan_frame: Annotated[str, typer.Option(help="Frame of the laser.")] = "base_scan",
    static_tf: Annotated[
        bool, typer.Option(help="Publish tf_static; switch it off beside a robot_state_publisher.")
    ] = True,
    map_odom_tf: Annotated[
        bool, typer.Option(help="Publish map to odom; switch it off beside a SLAM or a localisation.")
    ] = True,
    domain: Annotated[int | None, typer.Option(help="ROS domain.", show_default="ROS_DOMAIN_ID, or 0")] = None,
    local: Annotated[bool, typer.Option("--local", help="Talk only to programs on this machine.")] = False,
    config: Annotated[
        Path | None,
        typer.Option(
            help="YAML file of a SimulatorConfig.",
            show_default="a laser of 12 m that looks all round; the track quality's, with a policy",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of starts, people and noise.")] = 0,
    seconds: Annotated[
        float | None,
        typer.Option("--for", min=0.0, help="Simulated seconds after which to end.", show_default="at Ctrl-C"),
    ] = None,
) -> None:
    """Put simulated robots into a running ROS 2 graph, in place of Gazebo and without a ROS installation.

    Topics and frames are those of nav2's loopback simulator: cmd_vel and initialpose in; clock, tf, odom, scan and map
    out.
    """
    from contextlib import closing
    from dataclasses import replace

    from houseexpo.commands.printing import make_console
    from houseexpo.pseudoslam.agents.loading import load_policy
    from houseexpo.pseudoslam.ros.dds import Participant
    from houseexpo.pseudoslam.ros.fleet import Fleet
    from houseexpo.pseudoslam.ros.node import EVENTS, Node, NodeConfig
    from houseexpo.pseudoslam.ros.policy_driver import TRACK, PolicyDriver, check_interface, first_pose
    from houseexpo.pseudoslam.worlds.maps import MapHouse

    shown = make_console()

    def say(text: str) -> None:
        shown.print(text, highlight=False, soft_wrap=True)

    if not 1.0 <= rate <= 1000.0:
        raise ConfigError(f"rate: expected a number from 1 to 1000, found {rate:g}")
    maps = maps or ("slam" if policy else "none")
    node_config = NodeConfig(
        scan_hz=scan_hz, maps=maps, speed=speed, stepped=stepped, wall_time=wall_time, static=static_tf,
        localised=map_odom_tf, base=base_frame, scan=scan_frame,
    )  # fmt: skip
    simulated = _config(config, people, laser_noise, odometry_noise, TRACK.config if policy else None)
    starts = [_pose(text) for text in start or ()]
    houses = _Houses(dataset, plan, resolution)
    if config is None and isinstance(houses.first, MapHouse):
        simulated = replace(simulated, pixels_per_metre=houses.first.pixels_per_metre)

    named = load_policy(policy) if policy else None
    if named:
        check_interface(named)
        simulated = replace(simulated, observation=named.interface.view or simulated.observation)

    def fleet_in(one: House, starts: list[Pose]) -> Fleet:
        if policy and not starts:
            starts = [first_pose(one, simulated, seed)]
        return Fleet(one, simulated, robots=robots, seed=seed, starts=starts, tick_s=1.0 / rate)

    def drivers_of(fleet: Fleet, tell: Callable[[str], None]) -> list[PolicyDriver]:
        return [
            PolicyDriver(named, fleet, k, seed=seed, step_s=simulated.step_s, say=tell) for k in range(robots) if named
        ]

    with closing(Participant(domain, local=True if local else None, warn=say)) as network:
        with shown.status("making the house ready"):
            fleet = fleet_in(houses.first, starts)
            network.refuse_second(EVENTS)
            node = Node(
                network, fleet, node_config, house=lambda name: fleet_in(houses.load(name), []),
                drivers=drivers_of if policy else None, say=say,
            )  # fmt: skip
        with suppress(KeyboardInterrupt), _watch_signals() as is_told:
            where = f"{houses.first.id}, ROS domain {network.domain}"
            say(f"{len(fleet)} robot{'s' * (len(fleet) > 1)} in {where}; Ctrl-C ends it")
            node.run(float("inf") if seconds is None else seconds, until=is_told)
        say(f"ended after {node.elapsed_s:.1f} simulated seconds")


class _Houses:
    """The plan or the map to begin with, and others of the same data set or folder."""

    def __init__(self, dataset: Path | None, plan: str | None, resolution: float | None) -> None:
        from houseexpo.commands.arguments import is_plan_file, open_data_set
        from houseexpo.floorplan import load_plan
        from houseexpo.pseudoslam.worlds.maps import has_maps, open_maps

        self._data: Dataset | None = None
        self._maps: dict[str, MapHouse] = {}
        self.first: House
        if dataset is not None and has_maps(dataset):
            self._maps = {house.id: house for house in open_maps(dataset, resolution)}
            self.first = self.load(plan or next(iter(self._maps)))
        elif dataset is not None and is_plan_file(dataset):
            self.first = load_plan(dataset)
        else:
            self._data = open_data_set(dataset)
            self.first = self._data[plan] if plan else self._data[0]

    def load(self, plan_id: str) -> House:
        if self._maps:
            if plan_id not in self._maps:
                raise ConfigError(f"house {plan_id!r}: expected one of the maps {', '.join(self._maps)}")
            return self._maps[plan_id]
        if self._data is None:
            raise ConfigError(f"house {plan_id!r}: there is only {self.first.id!r}; start with a data set to choose")
        found: FloorPlan = self._data[plan_id]
        return found


def _config(
    path: Path | None,
    people: int | None,
    laser_noise: float | None,
    odometry_noise: float | None,
    track: SimulatorConfig | None,
) -> SimulatorConfig:
    from dataclasses import replace

    from houseexpo.pseudoslam.config import LaserConfig, SimulatorConfig

    if path:
        config = SimulatorConfig.from_yaml(path)
    elif track:
        config = track
    else:
        config = SimulatorConfig(laser=LaserConfig(_RANGE_M, 360.0, _RESOLUTION_DEG))
    noise = config.noise
    if laser_noise is not None:
        noise = replace(noise, laser_m=laser_noise)
    if odometry_noise is not None:
        noise = replace(noise, odometry_way=odometry_noise, odometry_turn=odometry_noise)
    walkers = config.people if people is None else replace(config.people, number=people)
    return replace(config, noise=noise, people=walkers)


def _pose(text: str) -> Pose:
    from math import isfinite, radians

    try:
        x, y, *rest = (float(part) for part in text.split(","))
        (degrees,) = rest or [0.0]
    except ValueError:
        x = y = degrees = float("nan")
    if not all(map(isfinite, (x, y, degrees))):
        raise ConfigError(f"start: expected x,y or x,y,degrees, for instance 2.5,1,90; found {text!r}")
    return x, y, radians(degrees)


@contextmanager
def _watch_signals() -> Iterator[Callable[[], bool]]:
    """Yield a function that says whether SIGTERM or Ctrl-C came, also where a shell started this in the background.

    At the first signal nothing is raised, since an exception within CycloneDDS's calls would be lost or become another
    one; at the second one, KeyboardInterrupt is.
    """
    told: list[int] = []

    def on_signal(number: int, _frame: FrameType | None) -> None:
        told.append(number)
        if len(told) > 1:
            raise KeyboardInterrupt

    before = {number: signal.signal(number, on_signal) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(told)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
