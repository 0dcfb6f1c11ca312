"""People who walk from room to room: what drives them, where they get, and that nothing ever overlaps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from houseexpo import FloorPlan
from houseexpo.errors import ConfigError
from houseexpo.pseudoslam import Simulator, SimulatorConfig
from houseexpo.pseudoslam.config.moving_obstacles import PeopleConfig, WalkModel
from houseexpo.pseudoslam.kernels.collision import MOVING, PERSON, STATIC, Disc, disc_is_free, placed_people
from houseexpo.pseudoslam.kernels.people import mark_bodies, social_force
from houseexpo.pseudoslam.render.sight import beam_ends, find_bodies
from houseexpo.pseudoslam.worlds.moving_obstacles import make_walk_params
from houseexpo.pseudoslam.worlds.world import make_world, traversable_cells
from tests.builders.simulations import NOBODY, Scene, assert_same, native, room, scene, singles
from tests.builders.tries import tries

PPM = 10.0


def house() -> FloorPlan:
    """Four rooms of 4 x 4 m round a corridor of 2 m, each with a door of 0.9 m to it."""
    walls = []
    for x in (0.0, 4.1):
        walls += [((x, 4.0, x + 1.5, 4.1)), ((x + 2.4, 4.0, x + 4.1, 4.1))]
        walls += [((x, 6.1, x + 1.5, 6.2)), ((x + 2.4, 6.1, x + 4.1, 6.2))]
    walls += [(4.0, 0.0, 4.1, 4.1), (4.0, 6.1, 4.1, 10.2)]
    import shapely

    space = shapely.box(0, 0, 8.1, 10.2) - shapely.union_all([shapely.box(*wall) for wall in walls])
    assert isinstance(space, shapely.Polygon)
    return FloorPlan(
        "house", list(space.exterior.coords)[:-1], 5, {}, holes=tuple(list(r.coords)[:-1] for r in space.interiors)
    )


def scene_of(plan: FloorPlan, people: PeopleConfig, robot: Disc = NOBODY, key: int = 1) -> Scene:
    world = make_world(plan, PPM, 0.2, 2.0)
    return scene(world.occupied.copy(), people, robot=robot, key=key, plan=plan)


def potential(x: float, y: float, other: tuple[float, float, float, float]) -> float:
    """V of the paper in metres: 2.1 m2/s2 by sigma 0.3 m over the smaller axis of an ellipse, a step of 1 s."""
    off, step = np.array([x - other[0], y - other[1]]), np.array(other[2:])
    axis = math.sqrt((np.hypot(*off) + np.hypot(*(off - step))) ** 2 - step @ step) / 2
    return 2.1 * math.exp(-axis / 0.3)


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.8, -0.3), (-0.6, 0.0)])
def test_others_push_as_the_slope_of_the_potential(velocity: tuple[float, float]) -> None:
    walk = make_walk_params(PeopleConfig(), PPM)
    people = np.zeros(2, PERSON)
    for x, y in ((5.7, 5.0), (5.4, 5.6), (4.2, 5.1), (5.0, 3.9)):
        other = (x, y, *velocity)
        people["x"], people["y"] = (50.0, x * PPM), (50.0, y * PPM)
        people["vx"], people["vy"] = (0.0, velocity[0] * PPM), (0.0, velocity[1] * PPM)
        ahead = np.array([x - 5.0, y - 5.0]) / math.hypot(x - 5.0, y - 5.0)
        h = 1e-6
        slope = [
            (potential(5.0 + h, 5.0, other) - potential(5.0 - h, 5.0, other)) / (2 * h),
            (potential(5.0, 5.0 + h, other) - potential(5.0, 5.0 - h, other)) / (2 * h),
        ]
        found = social_force(room(100, 100), people, walk, 0, *ahead.tolist(), NOBODY)
        assert np.array(found) / PPM == pytest.approx(-np.array(slope), rel=1e-4, abs=1e-6)
        behind = social_force(room(100, 100), people, walk, 0, *(-ahead).tolist(), NOBODY)
        assert np.array(behind) == pytest.approx(np.array(found) / 2)


def test_walls_push_away_the_more_the_nearer() -> None:
    walk, occupied, sizes = make_walk_params(PeopleConfig(), PPM), room(100, 100), []
    for x in (3.1, 4.1, 5.3, 9.0):
        people = np.zeros(1, PERSON)
        people["x"], people["y"] = x, 50.0
        push_x, push_y = social_force(occupied, people, walk, 0, 0.0, 1.0, NOBODY)
        assert push_y == pytest.approx(0.0, abs=1e-9)
        sizes.append(push_x)
    assert sizes[0] > sizes[1] >= sizes[2] >= sizes[3] == 0.0
    assert sizes[0] > 10.0


def test_alone_one_walks_at_the_speed_it_wishes_for() -> None:
    world = scene(room(60, 300), PeopleConfig(number=1), key=4)
    speeds = []
    for _ in range(100):
        world.step(seconds=0.1)
        speeds.append(math.hypot(world.bodies.people[0].vx, world.bodies.people[0].vy))
    assert np.median(speeds) == pytest.approx(world.bodies.people[0].speed, rel=0.05)


def test_speeds_are_drawn_from_a_normal_distribution_that_is_cut() -> None:
    config = PeopleConfig(number=200, radius_m=0.1)
    speeds = scene(room(200, 200), config).bodies.people["speed"] / PPM
    assert speeds.mean() == pytest.approx(1.2, abs=0.05)
    assert speeds.std() == pytest.approx(0.18, abs=0.03)
    assert abs(speeds - 1.2).max() == pytest.approx(0.4)  # at two standard deviations
    assert len(np.unique(speeds)) > 180


MODELS = ["social-force", "orca"]


@pytest.mark.parametrize("model", MODELS)
def test_everybody_gets_to_several_rooms_and_nobody_is_stuck(model: WalkModel) -> None:
    """Five minutes, a robot in the middle of the corridor."""
    plan, robot = house(), Disc(41.0, 52.0, 2.0)
    world = scene_of(plan, PeopleConfig(number=5, model=model), robot)
    from houseexpo.grids.raster import room_ids

    rooms = room_ids(plan.divided, world.frame)
    visited: list[set[int]] = [set() for _ in range(5)]
    anchor, stood, longest = world.places.copy(), np.zeros(5), 0.0
    for _ in range(600):
        world.step(robot)
        for p, (x, y) in enumerate(world.places.tolist()):
            visited[p].add(int(rooms[int(y), int(x)]))
        gone = np.hypot(*(world.places - anchor).T) > PPM
        anchor[gone], stood[gone] = world.places[gone], 0.0
        stood += 0.5
        longest = max(longest, stood.max())
    world.check(robot)
    assert min(len(v - {-1}) for v in visited) >= 3
    assert longest < 20.0
    assert world.bodies.people["visit"].min() > 10


def test_nobody_passes_a_robot_in_a_doorway() -> None:
    occupied = room(40, 81)
    occupied[:, 40] = 1
    occupied[16:24, 40] = 0
    robot = Disc(40.5, 20.0, 2.5)
    world = scene(occupied, PeopleConfig(number=4), robot=robot, key=3)
    sides = world.places[:, 0] < 40
    for _ in range(200):
        world.step(robot)
        world.check(robot)
    np.testing.assert_array_equal(world.places[:, 0] < 40, sides)
    crossed = np.zeros(4, bool)
    for _ in range(200):
        world.step()
        crossed |= (world.places[:, 0] < 40) != sides
    assert crossed.any()  # the robot has gone


@tries(25)
@example(seed=85, number=4, radius_m=0.35, ppm=16.0, model="social-force")  # a room for three
@given(
    st.integers(0, 10**6),
    st.integers(1, 6),
    st.sampled_from([0.1, 0.2, 0.35]),
    st.sampled_from([8.0, 10.0, 16.0]),
    st.sampled_from(MODELS),
)
def test_nothing_ever_overlaps(seed: int, number: int, radius_m: float, ppm: float, model: WalkModel) -> None:
    """Random rooms; a robot that jumps to any place that is free, also right beside people."""
    rng = np.random.default_rng(seed)
    occupied = room(*rng.integers(30, 70, 2).tolist())
    for _ in range(int(rng.integers(0, 8))):
        row, col = rng.integers(0, np.array(occupied.shape)).tolist()
        occupied[row : row + int(rng.integers(1, 12)), col : col + int(rng.integers(1, 12))] = 1
    try:
        world = scene(occupied, PeopleConfig(number, radius_m, model=model), ppm=ppm, key=seed)
    except ConfigError:
        return
    if not len(world.places):
        return
    robot = NOBODY
    for _ in range(12):
        for _ in range(60):
            x, y = rng.uniform(0, occupied.shape[::-1]).tolist()
            if rng.random() < 0.5:  # beside somebody
                angle, off = rng.uniform(0, 2 * math.pi), world.walk.radius_px + 2.0 + rng.exponential(0.2)
                x, y = world.places[0] + off * np.array([math.cos(angle), math.sin(angle)])
            apart = np.hypot(*(world.places - (x, y)).T).min() >= world.walk.radius_px + 2.0
            if apart and disc_is_free(world.occupied, x, y, 2.0):
                robot = Disc(float(x), float(y), 2.0)
                break
        if robot is not NOBODY and np.hypot(*(world.places - robot[:2]).T).min() < world.walk.radius_px + 2.0:
            robot = NOBODY  # it found no place this time
        world.step(robot, 0.3)
        world.check(robot)


def test_the_robot_that_came_nearer_by_a_part_of_a_cell_is_left_alone() -> None:
    """It goes by cells; the person's disc sticks out of its own by less than half a diagonal."""
    rng = np.random.default_rng(8)
    pressed = 0
    for key in range(40):
        world = scene(room(40, 40), PeopleConfig(number=1), key=key)
        for _ in range(40):
            angle, off = rng.uniform(0, 2 * math.pi), rng.uniform(3.3, 4.0)
            x, y = world.places[0] + off * np.array([math.cos(angle), math.sin(angle)])
            if disc_is_free(world.occupied, x, y, 2.0):
                break
        else:
            continue
        pressed += 1
        robot = Disc(float(x), float(y), 2.0)
        for _ in range(10):
            before = np.hypot(*(world.places[0] - robot[:2]))
            world.step(robot, 0.1)
            assert disc_is_free(world.occupied, *robot)
            after = np.hypot(*(world.places[0] - robot[:2]))
            assert after >= min(before, 4.0)
    assert pressed > 10


@pytest.mark.parametrize("model", MODELS)
def test_the_same_key_gives_the_same_bytes_and_another_another_walk(model: WalkModel) -> None:
    one, same, other = (scene_of(house(), PeopleConfig(number=4, model=model), key=key) for key in (7, 7, 8))
    for world in (one, same, other):
        for _ in range(20):
            world.step()
    for left, right in zip(one.bodies, same.bodies, strict=True):
        assert left.tobytes() == right.tobytes()
    assert one.occupied.tobytes() == same.occupied.tobytes()
    assert one.bodies.people.tobytes() != other.bodies.people.tobytes()
    assert set(one.bodies.people["goal"].tolist()) <= set(range(int(one.flow.sizes[0].goals)))


def test_people_start_away_from_the_robot_where_there_is_room() -> None:
    robot = Disc(30.0, 30.0, 2.0)
    for key in range(10):
        far = scene(room(60, 60), PeopleConfig(number=5), robot=robot, key=key)
        assert np.hypot(*(far.places - robot[:2]).T).min() >= PPM
        near = scene(room(16, 16), PeopleConfig(number=1), robot=Disc(4.0, 4.0, 2.0), key=key)
        near.check(Disc(4.0, 4.0, 2.0))


def test_too_many_are_refused_where_so_many_are_needed() -> None:
    with pytest.raises(ConfigError, match=r"people.least: 300 people of radius 0.2 m do not fit in plan 'box'"):
        scene(room(40, 40), PeopleConfig(number=300, least=300))
    with pytest.raises(ConfigError, match=r"people.least: expected a whole number of at most 3, found 4"):
        PeopleConfig(number=3, least=4)


def test_a_house_without_room_for_all_has_fewer() -> None:
    """All rules hold of those who found a place; the others are nowhere."""
    small = FloorPlan("small", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {})
    config = SimulatorConfig(pixels_per_metre=PPM, people=PeopleConfig(number=40), max_steps=50)
    simulator = Simulator.of(small, config)
    state = simulator.start(np.random.default_rng(0))
    people = placed_people(state.episode.bodies.people)
    assert 5 <= len(people) < 25
    assert not any(state.episode.bodies.people[len(people) :].tobytes())
    assert len(find_bodies(simulator, state, beam_ends(simulator, state))) == len(people)
    for _ in range(20):
        simulator.step(state, "left")
        places = np.stack([people["x"], people["y"]], axis=1)
        apart = np.hypot(*(places[:, None] - places[None]).T) + 9 * np.eye(len(people))
        assert apart.min() >= 2 * 0.2 * PPM - 1e-9
        drawn = state.episode.occupied & STATIC
        mark_bodies(drawn, state.episode.bodies._replace(people=people), state.episode.tracks, simulator.params.walk)
        np.testing.assert_array_equal(drawn, state.episode.occupied)
    assert not any(state.episode.bodies.people[len(people) :].tobytes())


def test_houses_with_and_without_room_step_together_as_alone() -> None:
    houses = [house(), FloorPlan("small", [(0, 0), (0, 2), (2, 2), (2, 0)], 1, {})]
    config = SimulatorConfig(pixels_per_metre=PPM, people=PeopleConfig(number=40), max_steps=6)
    together = native("Exploration", 3, dataset=houses, config=config)
    alone = singles("Exploration", 3, dataset=houses, config=config)
    assert_same(together.reset(seed=1), alone.reset(seed=1))
    for _ in range(5):
        assert_same(together.step(np.ones(3, np.int64)), alone.step(np.ones(3, np.int64)))


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"number": -1}, "people.number: expected a whole number"),
        ({"number": 1.5}, "people.number"),
        ({"radius_m": 0.0}, "people.radius_m: expected more than 0"),
        ({"speed_m_s": float("nan")}, "people.speed_m_s: expected a finite"),
        ({"speed_m_s": 30.0}, "people.speed_m_s: expected at most 20"),
        ({"speed_sd": -0.1}, "people.speed_sd: expected at least 0"),
        ({"relaxation_s": 0.01}, "people.relaxation_s: expected at least 0.1"),
    ],
)
def test_bad_people_are_refused(values: dict[str, float], problem: str) -> None:
    with pytest.raises(ConfigError, match=problem):
        PeopleConfig(**values)  # type: ignore[arg-type]


def test_standing_people_are_drawn_whatever_their_size() -> None:
    world = scene(room(40, 40), PeopleConfig(number=1, radius_m=0.01))
    assert (world.occupied & MOVING).any()
    assert traversable_cells(world.static, 0.1).any()
