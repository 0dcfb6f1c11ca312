"""What must hold wherever obstacles are set down."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, event, given
from hypothesis import strategies as st

from houseexpo.errors import ConfigError
from houseexpo.grids.frame import GridFrame
from houseexpo.pseudoslam.config.obstacles import (
    Circle,
    Ellipse,
    Obstacle,
    ObstaclesConfig,
    Polygon,
    RandomObstacles,
    Rectangle,
)
from houseexpo.pseudoslam.worlds.place_obstacles import place_obstacles
from houseexpo.pseudoslam.worlds.world import traversable_cells
from tests.builders.tries import tries

PPM = 10.0
metres = st.floats(0.001, 3.0)
corner = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))


def _has_area(points: tuple[tuple[float, float], ...]) -> bool:
    try:
        Polygon(points)
    except ConfigError:
        return False
    return True


boxes, rounds = st.builds(Rectangle, metres, metres), st.builds(Ellipse, metres, metres) | st.builds(Circle, metres)
rings = st.lists(corner, min_size=3, max_size=7, unique=True).map(tuple).filter(_has_area)
shapes = boxes | rounds | st.builds(Polygon, rings)
obstacles = st.builds(Obstacle, shapes, st.floats(-1.0, 6.0), st.floats(-1.0, 5.0), st.floats(-360.0, 360.0))
seeds = st.integers(0, 2**32 - 1)


def house(seed: int) -> tuple[np.ndarray, GridFrame]:
    """5 x 4 m with a few walls, some with doors."""
    rng, frame = np.random.default_rng(seed), GridFrame.around((0, 0, 5, 4), PPM, y_up=True)
    occupied = np.ones(frame.shape, np.uint8)
    occupied[1:-1, 1:-1] = 0
    for _ in range(rng.integers(0, 4)):
        row, col = rng.integers(3, 38, 2)
        if rng.random() < 0.5:
            occupied[row, : rng.integers(1, 50)] = 1
        else:
            occupied[rng.integers(1, 40) :, col] = 1
    return occupied, frame


@given(
    seeds, st.floats(0.05, 0.4), st.just([]) | st.lists(obstacles, max_size=2), st.integers(0, 6), st.floats(0.0, 0.4)
)
@tries(100)
def test_a_house_stays_whole(seed: int, radius_m: float, told: list[Obstacle], number: int, gap_m: float) -> None:
    occupied, frame = house(seed)
    traversable = traversable_cells(occupied, radius_m * PPM)
    assume(traversable.any())
    random = RandomObstacles((number, number), (0.05, 1.0), gap_m=gap_m)
    try:
        placed = place_obstacles(
            occupied, traversable, frame, plan_id="house", radius_px=radius_m * PPM,
            config=ObstaclesConfig(tuple(told), random), rng=np.random.default_rng(seed),
        )  # fmt: skip
    except ConfigError as error:
        event("refused")
        assert str(error).startswith(("obstacles.placed[", "obstacles.random.number: at most"))  # noqa: PT017
        return
    masks = [obstacle.mask(frame) for obstacle in placed.obstacles]
    assert len(masks) == len(told) + number
    assert all(mask.any() for mask in masks)
    assert (sum((mask.astype(int) for mask in masks), occupied.astype(int)) == placed.occupied).all()
    assert placed.traversable.any()
    fits = traversable_cells(np.where(stand_region(traversable, radius_m * PPM), placed.occupied, 1), radius_m * PPM)
    assert (fits == placed.traversable).all()


def stand_region(traversable: np.ndarray, radius_px: float) -> np.ndarray:
    """Cells that the robot's disc touches from somewhere: the part of the house that it was in."""
    reach = int(radius_px) + 2
    rows, cols = np.indices(traversable.shape)
    region = np.zeros(traversable.shape, bool)
    for down in range(-reach, reach + 1):
        for right in range(-reach, reach + 1):
            if np.hypot(max(abs(down) - 0.5, 0), max(abs(right) - 0.5, 0)) < radius_px - 1e-9:
                inside = (rows + down >= 0) & (rows + down < len(traversable)) & (cols + right >= 0)
                inside &= cols + right < traversable.shape[1]
                region |= inside & (
                    traversable[(rows + down) % len(traversable), (cols + right) % traversable.shape[1]] != 0
                )
    return region


@given(obstacles, st.sampled_from([5.0, 10.0, 16.0, 33.0]))
@tries(150)
def test_no_obstacle_vanishes(obstacle: Obstacle, pixels_per_metre: float) -> None:
    frame = GridFrame((-10.0, -10.0), pixels_per_metre, (int(25 * pixels_per_metre),) * 2, y_up=True)
    mask = obstacle.mask(frame)
    assert mask.any()
    spans, count, inside = obstacle.spans(frame)
    assert inside
    assert (spans[:count, 1] < spans[:count, 2]).all()
