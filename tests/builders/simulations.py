"""Small houses and robots in them: single and vector environments, worlds in which things move, stores of worlds."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import VectorEnv

from houseexpo import FloorPlan
from houseexpo.grids.frame import GridFrame
from houseexpo.plan import PlanObject, Room
from houseexpo.plan.json_codec import encode
from houseexpo.pseudoslam.agents.explorers import NearestFrontier
from houseexpo.pseudoslam.agents.protocol import Robot, make_knowledge
from houseexpo.pseudoslam.config import ObservationConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, Trajectory
from houseexpo.pseudoslam.kernels.body_tracks import BodyTracks, Tracks, distance_to_body
from houseexpo.pseudoslam.kernels.collision import MOVING, STATIC, Disc, disc_is_free, placed_people
from houseexpo.pseudoslam.kernels.people import WalkParams, mark_bodies, move_bodies
from houseexpo.pseudoslam.kernels.planning.fields import FlowField, no_flow_field
from houseexpo.pseudoslam.simulator import ACTIONS, Action, Simulator
from houseexpo.pseudoslam.state import State
from houseexpo.pseudoslam.worlds.moving_obstacles import (
    make_flow_field,
    make_tracks,
    make_walk_params,
    new_bodies,
    start_people,
)
from houseexpo.pseudoslam.worlds.world import World

PLAIN = SimulatorConfig()


def hall(width: float = 8.0, height: float = 4.0) -> FloorPlan:
    return FloorPlan("hall", [(0, 0), (0, height), (width, height), (width, 0)], 1, {})


def corner() -> FloorPlan:
    """A room whose wall at x = 5 has 4 m of nothing behind it."""
    return FloorPlan("corner", [(0, 0), (0, 4), (5, 4), (5, 0.5), (9, 0.5), (9, 0)], 1, {})


def hall_with_cell() -> FloorPlan:
    """A hall whose right part, 2 m wide, is behind a gap of 0.3 m."""
    verts = [(0, 0), (0, 4), (5, 4), (5, 2.3), (5.1, 2.3), (5.1, 4), (7, 4), (7, 0), (5.1, 0), (5.1, 2), (5, 2), (5, 0)]
    return FloorPlan("cell", verts, 1, {})


def flat(plan_id: str = "flat") -> FloorPlan:
    """A kitchen with a chair and a bedroom with a bed, 0.2 m apart, and an opening of 1 m between them."""
    verts = [
        (0, 0),
        (0, 4),
        (4, 4),
        (4, 2.5),
        (4.2, 2.5),
        (4.2, 4),
        (9, 4),
        (9, 0),
        (4.2, 0),
        (4.2, 1.5),
        (4, 1.5),
        (4, 0),
    ]
    rings = [box(1.0, 0.8, 1.5, 1.3), box(6.5, 2.2, 8.2, 3.4)]
    return FloorPlan(
        plan_id, verts, 2, {}, holes=[ring[::-1] for ring in rings],
        rooms=[Room(0, "Kitchen", box(0, 0, 4, 4)), Room(1, "Bedroom", box(4.2, 0, 9, 4))],
        objects=[PlanObject(0, "chair", 0, rings[0], 0.9), PlanObject(1, "bed", 1, rings[1], 0.5)],
    )  # fmt: skip


def box(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float]]:
    return [(x1, y1), (x1, y2), (x2, y2), (x2, y1)]


def at(x: float, y: float, heading: float, config: SimulatorConfig = PLAIN) -> SimulatorConfig:
    return replace(config, start=StartConfig(random=False, x_m=x, y_m=y, heading_deg=heading))


def started(config: SimulatorConfig, plan: FloorPlan | None = None) -> tuple[Simulator, State, np.random.Generator]:
    rng = np.random.default_rng(0)
    simulator = Simulator.of(plan or hall(), config)
    return simulator, simulator.start(rng), rng


def wander(simulator: Simulator, state: State, rng: np.random.Generator, steps: int) -> None:
    """Forward most of the time, turn when blocked."""
    for _ in range(steps):
        simulator.step(state, "left" if state.blocked or rng.random() < 0.2 else "forward")


# Small worlds in which things move, and what must hold of them at any time.


NOBODY = Disc(-1e6, -1e6, 1.0)


@dataclass
class Scene:
    """A world with bodies in it; ``occupied`` has their bits, ``static`` has not."""

    static: np.ndarray
    occupied: np.ndarray
    frame: GridFrame
    bodies: BodyTracks
    tracks: Tracks
    flow: FlowField
    walk: WalkParams
    key: int

    def step(self, robot: Disc = NOBODY, seconds: float = 0.5) -> None:
        """Let everything move."""
        move_bodies(self.occupied, self.bodies, self.tracks, self.flow, self.walk, self.key, robot, seconds)

    @property
    def places(self) -> np.ndarray:
        """(P, 2) where people are, pixels."""
        return np.stack([self.bodies.people["x"], self.bodies.people["y"]], axis=1)

    def check(self, robot: Disc) -> None:
        """Nothing overlaps, and the grid shows the bodies and nothing else."""
        radius = self.walk.radius_px
        for p, (x, y) in enumerate(self.places.tolist()):
            assert disc_is_free(self.static, x, y, radius)
            assert math.hypot(x - robot.x, y - robot.y) >= radius + robot.radius - 1e-9
            for other_x, other_y in self.places[:p].tolist():
                assert math.hypot(x - other_x, y - other_y) >= 2 * radius
            for k, clock in enumerate(self.bodies.clocks.tolist()):
                assert distance_to_body(self.tracks, k, clock, x, y) >= radius - 1e-9
        assert disc_is_free(self.occupied, *robot) or not on_grid(self.occupied, robot)
        np.testing.assert_array_equal(self.occupied & STATIC, self.static)
        drawn = self.static.copy()
        mark_bodies(drawn, self.bodies, self.tracks, self.walk)
        np.testing.assert_array_equal(self.occupied, drawn)


def on_grid(grid: np.ndarray, disc: Disc) -> bool:
    """Whether a disc's centre lies on a grid."""
    return 0 <= disc.x < grid.shape[1] and 0 <= disc.y < grid.shape[0]


def room(rows: int, cols: int) -> np.ndarray:
    """Free cells within walls of one."""
    occupied = np.ones((rows, cols), np.uint8)
    occupied[1:-1, 1:-1] = 0
    return occupied


def frame_of(occupied: np.ndarray, ppm: float) -> GridFrame:
    """A frame whose lower left corner is (0, 0), row 0 at the highest y."""
    return GridFrame((0.0, 0.0), ppm, occupied.shape, y_up=True)


def plan_of(occupied: np.ndarray, ppm: float, room_num: int = 4) -> FloorPlan:
    """The bounding box of a grid as a plan."""
    height, width = occupied.shape[0] / ppm, occupied.shape[1] / ppm
    return FloorPlan("box", [(0, 0), (0, height), (width, height), (width, 0)], room_num, {})


def scene(
    occupied: np.ndarray,
    people: PeopleConfig | None = None,
    trajectories: Sequence[Trajectory] = (),
    *,
    ppm: float = 10.0,
    robot: Disc = NOBODY,
    key: int = 1,
    plan: FloorPlan | None = None,
) -> Scene:
    """Put things into a grid of what stands still."""
    people = people or PeopleConfig()
    frame, plan = frame_of(occupied, ppm), plan or plan_of(occupied, ppm)
    walk, tracks = make_walk_params(people, ppm), make_tracks(trajectories, occupied, frame, "box")
    flow = make_flow_field(occupied, frame, people.radius_m, plan) if people.number else no_flow_field()
    bodies = new_bodies(len(trajectories), people.number)
    start_people(people, occupied, bodies, tracks, flow, walk, key, robot, "box")
    bodies = bodies._replace(people=placed_people(bodies.people))  # a small room takes fewer than it is asked to
    drawn = occupied.copy()
    mark_bodies(drawn, bodies, tracks, walk)
    assert (drawn & MOVING).any() == (len(bodies.people) + len(trajectories) > 0)
    return Scene(occupied, drawn, frame, bodies, tracks, flow, walk, key)


# Vector environments beside gymnasium's own of single ones, compared bit by bit.


def hut(plan_id: str, side_m: float) -> FloorPlan:
    """A room 1.6 times as wide as it is high."""
    width = 1.6 * side_m
    return FloorPlan(plan_id, [(0, 0), (0, side_m), (width, side_m), (width, 0)], 1, {})


HUTS = [hut("small", 3.0), hut("middle", 4.5), hut("large", 6.0)]


def native(task: str, number: int, mode: str = "NextStep", **given: Any) -> VectorEnv:
    """The project's vector environment."""
    return gymnasium.make_vec(f"PseudoSLAM/{task}-v0", num_envs=number, autoreset_mode=mode, **given)


def singles(task: str, number: int, mode: str = "NextStep", **given: Any) -> VectorEnv:
    """gymnasium's, of single environments."""
    return gymnasium.make_vec(
        f"PseudoSLAM/{task}-v0",
        num_envs=number,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        **given,
    )


def assert_same(one: Any, other: Any, where: str = "") -> None:
    """Nested dictionaries, tuples and arrays are equal, types included."""
    assert type(one) is type(other), (where, type(one), type(other))
    if isinstance(one, dict):
        assert set(one) == set(other), (where, set(one) ^ set(other))
        for key in one:
            assert_same(one[key], other[key], f"{where}/{key}")
    elif isinstance(one, tuple) or (isinstance(one, np.ndarray) and one.dtype == object):
        assert len(one) == len(other), where
        for i, (part, its) in enumerate(zip(one, other, strict=True)):
            assert_same(part, its, f"{where}/{i}")
    elif isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape), (where, one.dtype, other.dtype)
        assert one.tobytes() == other.tobytes(), (where, one, other)
    else:
        assert one == other, (where, one, other)


def assert_same_step(one: tuple[Any, ...], other: tuple[Any, ...], where: object = "") -> None:
    """What ``reset`` or ``step`` returned is equal; infos where their masks say that they speak of an environment."""
    assert_same(one[:-1], other[:-1], str(where))
    _assert_same_infos(one[-1], other[-1], f"{where}, info")


def _assert_same_infos(one: dict[str, Any], other: dict[str, Any], where: str = "") -> None:
    """Infos are equal where their masks say that they speak of an environment; masks are equal."""
    assert set(one) == set(other), (where, set(one) ^ set(other))
    for key, value in one.items():
        if key.startswith("_") or f"_{key}" not in one:
            assert_same(value, other[key], f"{where}/{key}")
        elif isinstance(value, dict):
            _assert_same_infos(value, other[key], f"{where}/{key}")
        else:
            mask = one[f"_{key}"]
            assert_same(value[mask], other[key][mask], f"{where}/{key}")


# Vector environments of explorers in small houses.


SMALL = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0, global_cells=32), max_steps=60)
GIVEN: dict[str, Any] = {"dataset": HUTS, "config": SMALL}


def explorers(number: int, mode: str = "NextStep", **given: Any) -> Any:
    return native("Exploration", number, mode, success_coverage=None, **{**GIVEN, **given})


# Environments of huts in which an action is a travel.


SMALL_PLANNER = SimulatorConfig(pixels_per_metre=16.0, observation=ObservationConfig(3.0), max_steps=200)


def env_of(actions: str, task: str = "Exploration", **given: Any) -> gymnasium.Env:
    """Return an environment of the huts."""
    given = {"dataset": HUTS, "config": SMALL_PLANNER, **given}
    return gymnasium.make(f"PseudoSLAM/{task}-v0", actions=actions, **given)


# Stores of worlds: three huts at a coarse grid, the files that hold them, and when two worlds are the same.


COARSE = SimulatorConfig(pixels_per_metre=10.0)


def assert_same_world(one: World, other: World) -> None:
    assert (one.plan_id, one.frame, one.observable_cells) == (other.plan_id, other.frame, other.observable_cells)
    for name in ("occupied", "traversable", "observable"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        assert getattr(one, name).dtype == np.uint8
        assert not getattr(one, name).flags.writeable


def write_huts(folder: Path) -> Path:
    """Write a data set of the three huts into a folder."""
    file = folder / "huts.jsonl"
    file.write_bytes(b"\n".join(map(encode, HUTS)))
    return file


def yield_frontier_actions(simulator: Simulator, state: State) -> Iterator[Action]:
    """Yield the actions of ``NearestFrontier`` on the current map until nothing is left to see; take each at once."""
    explorer = NearestFrontier(Robot(simulator.config), 0)
    while (action := explorer(None, make_knowledge(simulator, state))) is not None:
        yield ACTIONS[action]
