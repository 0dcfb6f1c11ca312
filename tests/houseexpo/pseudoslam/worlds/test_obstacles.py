"""Obstacles in a house: where they can stand, and what they must not close off."""

from __future__ import annotations

import math
import re
import time
from collections import Counter

import numpy as np
import pytest

from houseexpo.errors import ConfigError
from houseexpo.floorplan import decode
from houseexpo.grids.frame import GridFrame
from houseexpo.grids.raster import free_mask
from houseexpo.pseudoslam.config.obstacles import Circle, Ellipse, Obstacle, ObstaclesConfig, RandomObstacles, Rectangle
from houseexpo.pseudoslam.worlds.place_obstacles import PlacedObstacles, place_obstacles
from houseexpo.pseudoslam.worlds.world import traversable_cells

PPM, RADIUS_M = 20.0, 0.2
RADIUS_PX = PPM * RADIUS_M
House = tuple[np.ndarray, np.ndarray, GridFrame]


def house(*boxes: tuple[float, float, float, float], side: float = 4.0) -> House:
    """A square room without the boxes (x1, y1, x2, y2), metres: solid, standing cells, frame."""
    frame = GridFrame.around((0, 0, side, side), PPM, y_up=True)
    occupied = np.ones(frame.shape, np.uint8)
    occupied[1:-1, 1:-1] = 0
    for x1, y1, x2, y2 in boxes:
        occupied |= Obstacle(Rectangle(x2 - x1, y2 - y1), (x1 + x2) / 2, (y1 + y2) / 2).mask(frame).view(np.uint8)
    return occupied, traversable_cells(occupied, RADIUS_PX), frame


def two_rooms(door_m: float) -> House:
    """A wall across the middle, x 1.9 to 2.1, with a door from y = 1."""
    return house((1.9, 0.0, 2.1, 1.0), (1.9, 1.0 + door_m, 2.1, 4.0))


def put(found: House, *obstacles: Obstacle, random: RandomObstacles | None = None, seed: int = 0) -> PlacedObstacles:
    config = ObstaclesConfig(obstacles, random)
    return place_obstacles(*found, plan_id="house", radius_px=RADIUS_PX, config=config, rng=np.random.default_rng(seed))


def check(found: House, placement: PlacedObstacles) -> None:
    """Nothing overlaps, and the robot stands where it would be said to."""
    occupied, traversable, frame = found
    masks = [obstacle.mask(frame) for obstacle in placement.obstacles]
    np.testing.assert_array_equal(sum((mask.astype(int) for mask in masks), occupied.astype(int)), placement.occupied)
    np.testing.assert_array_equal(traversable_cells(placement.occupied, RADIUS_PX), placement.traversable)
    assert (placement.traversable <= traversable).all()


def test_none_by_default() -> None:
    found = house()
    rng = np.random.default_rng(0)
    placement = place_obstacles(*found, plan_id="house", radius_px=RADIUS_PX, config=ObstaclesConfig(), rng=rng)
    np.testing.assert_array_equal(placement.occupied, found[0])
    assert placement.obstacles == ()
    assert placement.occupied is not found[0]
    assert rng.random() == np.random.default_rng(0).random()


def test_obstacles_stand_where_they_are_told_to() -> None:
    """They may touch each other and a wall. The published simulator halves what it calls radius."""
    found = house()
    table, stool = Obstacle(Rectangle(1.0, 0.5), 0.5, 3.75), Obstacle(Circle(0.25), 1.25, 3.75)
    placement = put(found, table, stool)
    check(found, placement)
    assert placement.obstacles == (table, stool)
    assert (placement.occupied - found[0]).sum() == pytest.approx((0.5 + math.pi * 0.25**2) * PPM**2, abs=4)


@pytest.mark.parametrize(
    ("obstacle", "message"),
    [
        (Obstacle(Circle(0.3), 0.2, 2.0), "[1]: the circle at (0.2, 2) m in plan 'house' overlaps a wall"),
        (Obstacle(Circle(0.3), 9.0, 2.0), "[1]: the circle at (9, 2) m in plan 'house' overlaps a wall"),
        (Obstacle(Ellipse(0.3, 0.1), 2.3, 2.0), "[1]: the ellipse at (2.3, 2) m in plan 'house' overlaps"),
        (Obstacle(Rectangle(0.2, 1.7), 2.0, 0.85), "[1]: the rectangle at (2, 0.85) m in plan 'house' closes"),
    ],
)
def test_a_place_that_cannot_be_is_named(obstacle: Obstacle, message: str) -> None:
    """The last one builds a wall up to the first."""
    found = house((1.9, 2.3, 2.1, 4.0))
    first = Obstacle(Rectangle(0.6, 0.4), 2.0, 2.1)
    check(found, put(found, first))
    with pytest.raises(ConfigError, match=re.escape("obstacles.placed" + message)):
        put(found, first, obstacle)


@pytest.mark.parametrize(("door_m", "way_m"), [(0.9, 0.45), (0.9, 0.35)])
def test_a_door_stays_wide_enough_for_the_robot(door_m: float, way_m: float) -> None:
    found = two_rooms(door_m)
    obstacle = Obstacle(Rectangle(0.2, door_m - way_m), 2.0, 1.0 + (door_m - way_m) / 2)
    if way_m > 2 * RADIUS_M:
        check(found, put(found, obstacle))
    else:
        with pytest.raises(ConfigError, match=r"obstacles.placed\[0\]: .* closes off a part of the house"):
            put(found, obstacle)


def test_a_way_round_is_enough() -> None:
    """One of two doors may be shut, not both."""
    found = house((1.9, 0.0, 2.1, 0.5), (1.9, 1.2, 2.1, 2.8), (1.9, 3.5, 2.1, 4.0))
    lower, upper = Obstacle(Rectangle(0.2, 0.7), 2.0, 0.85), Obstacle(Rectangle(0.2, 0.7), 2.0, 3.15)
    for one in (lower, upper):
        check(found, put(found, one))
    with pytest.raises(ConfigError, match=r"placed\[1\]: .* closes off a part of the house"):
        put(found, lower, upper)


def test_a_nook_smaller_than_the_robot_is_no_part_of_the_house() -> None:
    """In the corner is room for the robot's middle in a few cells; it cannot get there, and need not."""
    found = house()
    bar = Obstacle(Rectangle(1.3, 0.1), 0.55, 0.55, -45.0)
    placement = put(found, bar)
    check(found, placement)
    assert placement.traversable[-1 - 5, 5] == 0
    assert found[1][-1 - 5, 5] == 1
    with pytest.raises(ConfigError, match="closes off a part of the house"):
        put(found, Obstacle(Rectangle(2.3, 0.1), 0.9, 0.9, -45.0))


@pytest.mark.parametrize("shape", ["rectangle", "ellipse", "circle", "polygon"])
def test_random_obstacles_in_real_houses(shape: str, published_lines: list[bytes]) -> None:
    """Sizes stay what was asked for (the published simulator rewrites them), and starts stay out of pockets."""
    config = ObstaclesConfig(random=RandomObstacles((20, 20), (0.2, 0.6), (shape,), gap_m=0.1))
    for line in published_lines[:3]:
        free, frame = free_mask(decode(line), PPM, y_up=True)
        occupied = (~free).view(np.uint8)
        found = occupied, traversable_cells(occupied, RADIUS_PX), frame
        placement = place_obstacles(
            *found, plan_id="house", radius_px=RADIUS_PX, config=config, rng=np.random.default_rng(3)
        )
        check(found, placement)
        assert [type(obstacle.shape).__name__.lower() for obstacle in placement.obstacles] == [shape] * 20
        for obstacle in placement.obstacles:
            corners = [math.hypot(x, y) for x, y in obstacle.shape.outline_m]
            assert max(corners) <= 0.3 * math.sqrt(2) + 1e-9
            mask, rest = obstacle.mask(frame), placement.occupied.astype(bool)
            assert gap_px(mask, rest & ~mask) >= 0.1 * PPM - 1e-9


@pytest.mark.parametrize("pixels_per_metre", [10.0, 16.0, 25.0, 33.0, 50.0])
@pytest.mark.parametrize("shape", ["rectangle", "ellipse", "circle", "polygon"])
def test_random_obstacles_keep_their_gap_at_any_resolution(shape: str, pixels_per_metre: float) -> None:
    """Between the near sides of cells: from each other, and from walls, of which two are oblique."""
    frame = GridFrame.around((0, 0, 4, 3), pixels_per_metre, y_up=True)
    occupied = np.ones(frame.shape, np.uint8)
    occupied[1:-1, 1:-1] = 0
    for wall in (Obstacle(Rectangle(2.0, 0.1), 1.2, 1.4, 25.0), Obstacle(Rectangle(0.8, 0.1), 3.2, 2.0, 70.0)):
        occupied |= wall.mask(frame).view(np.uint8)
    radius_px = 0.1 * pixels_per_metre
    for seed, gap_m in enumerate((0.05, 0.05, 0.12, 0.2)):
        config = ObstaclesConfig(random=RandomObstacles((3, 9), (0.1, 0.5), (shape,), gap_m))
        placed = place_obstacles(
            occupied, traversable_cells(occupied, radius_px), frame, plan_id="house", radius_px=radius_px,
            config=config, rng=np.random.default_rng(seed),
        )  # fmt: skip
        for obstacle in placed.obstacles:
            mask = obstacle.mask(frame)
            away = ~padded(mask, math.ceil(gap_m * pixels_per_metre) + 2)
            near = placed.occupied.astype(bool) & ~mask & ~away
            assert not near.any() or gap_px(mask, near) >= gap_m * pixels_per_metre - 1e-9


def padded(mask: np.ndarray, by: int) -> np.ndarray:
    """The box around a mask, wider by some cells on each side."""
    rows, cols = np.nonzero(mask)
    box = np.zeros_like(mask)
    box[max(rows.min() - by, 0) : rows.max() + by + 1, max(cols.min() - by, 0) : cols.max() + by + 1] = True
    return box


def gap_px(one: np.ndarray, other: np.ndarray) -> float:
    """Cells between the near sides of two sets of cells."""
    apart = np.maximum(np.abs(np.argwhere(one)[:, None, :] - np.argwhere(other)) - 1, 0)
    return float(np.sqrt((apart**2).sum(axis=-1)).min())


def test_a_seed_gives_the_same_obstacles_and_another_one_others() -> None:
    found = house()
    one, same, other = (put(found, random=RandomObstacles((3, 3)), seed=seed) for seed in (1, 1, 2))
    assert one.obstacles == same.obstacles != other.obstacles
    assert one.occupied.tobytes() == same.occupied.tobytes() != other.occupied.tobytes()


def test_numbers_and_shapes_are_drawn_evenly() -> None:
    found, rng = house(), np.random.default_rng(0)
    config = ObstaclesConfig(random=RandomObstacles((1, 3), (0.1, 0.3)))
    drawn = [
        place_obstacles(*found, plan_id="house", radius_px=RADIUS_PX, config=config, rng=rng).obstacles
        for _ in range(300)
    ]
    numbers = Counter(map(len, drawn))
    assert set(numbers) == {1, 2, 3}
    assert min(numbers.values()) > 70
    kinds = Counter(type(obstacle.shape).__name__ for obstacles in drawn for obstacle in obstacles)
    assert set(kinds) == {"Rectangle", "Ellipse", "Circle", "Polygon"}
    assert min(kinds.values()) > 0.2 * kinds.total()
    places = np.array([(obstacle.x_m, obstacle.y_m) for obstacles in drawn for obstacle in obstacles])
    assert places.mean(axis=0) == pytest.approx([2.0, 2.0], abs=0.2)
    assert places.min() < 0.4  # along the walls too; the published simulator keeps to 10-80% of the box
    assert places.max() > 3.6


def test_random_ones_keep_clear_of_those_told() -> None:
    found = house()
    told = Obstacle(Rectangle(1.0, 1.0), 2.0, 2.0)
    placement = put(found, told, random=RandomObstacles((8, 8), (0.2, 0.5)))
    check(found, placement)
    assert placement.obstacles[0] == told
    assert len(placement.obstacles) == 9


def test_more_than_fit_are_refused_soon() -> None:
    """The published simulator searches for ever."""
    start = time.process_time()
    with pytest.raises(ConfigError, match=r"obstacles.random.number: at most \d+ of 500 obstacles .* 16.0 m²") as error:
        put(house(), random=RandomObstacles((500, 500)))
    assert 10 < int(re.findall(r"most (\d+)", str(error.value))[0]) < 300
    assert time.process_time() - start < 20  # also without compilation


def test_too_large_ones_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"at most 0 of 1 obstacles"):
        put(house(), random=RandomObstacles((1, 1), (50.0, 50.0), ("circle",)))


def test_arrays_are_used_again() -> None:
    found = house()
    first = put(found, random=RandomObstacles((4, 4)))
    config = ObstaclesConfig(random=RandomObstacles((4, 4)))
    again = place_obstacles(
        *found, plan_id="house", radius_px=RADIUS_PX, config=config, rng=np.random.default_rng(7), into=first
    )
    assert again.occupied is first.occupied
    np.testing.assert_array_equal(again.occupied, put(found, random=RandomObstacles((4, 4)), seed=7).occupied)
    check(found, again)
