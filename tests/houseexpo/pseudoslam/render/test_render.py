from __future__ import annotations

import math
import sys
import warnings
from dataclasses import replace

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import houseexpo.pseudoslam  # noqa: F401  # registers the environments
from houseexpo import FloorPlan
from houseexpo.errors import ConfigError, MissingDependencyError
from houseexpo.pseudoslam.config import GoalConfig, NoiseConfig, ObservationConfig, SimulatorConfig, StartConfig
from houseexpo.pseudoslam.config.moving_obstacles import Trajectory
from houseexpo.pseudoslam.config.obstacles import Circle, Obstacle, ObstaclesConfig, Rectangle
from houseexpo.pseudoslam.render import picture as render
from houseexpo.pseudoslam.render.canvas import scale_cells
from houseexpo.pseudoslam.render.picture import draw_episode, draw_world_and_map
from houseexpo.pseudoslam.simulator import Simulator
from houseexpo.pseudoslam.state import State

HALL = FloorPlan("hall", [(0, 0), (0, 4), (8, 4), (8, 0)], 1, {})
EAST = SimulatorConfig(pixels_per_metre=20.0, start=StartConfig(random=False, x_m=2.0, y_m=1.0))
"""The robot stands at the lower left and looks to the right."""
SMALL = replace(EAST, observation=ObservationConfig(2.0), max_steps=20)


def started(config: SimulatorConfig = EAST) -> tuple[Simulator, State]:
    simulator = Simulator.of(HALL, config)
    return simulator, simulator.start(np.random.default_rng(0))


def resting(x: float, y: float) -> Trajectory:
    return Trajectory(Circle(0.25), times_s=(0, 1), poses=((x, y, 0), (x, y, 0)))


def colour_at(simulator: Simulator, image: np.ndarray, x_m: float, y_m: float) -> tuple[int, ...]:
    """The colour of a place in the plan's metres."""
    cells = simulator.world.frame.shape
    across, down = simulator.world.frame.pixels_from_points((x_m, y_m)) * image.shape[1] / cells[1]
    return tuple(image[int(down), int(across)].tolist())


def seen(colour: tuple[int, int, int]) -> tuple[int, ...]:
    """A colour under the robot's sight."""
    return tuple(
        np.rint(np.array(colour) * (1 - render.SIGHT) + np.array(render.ROBOT_COLOUR) * render.SIGHT).astype(int)
    )


def test_the_map_shows_what_is_known_the_right_way_round() -> None:
    simulator, state = started()
    image = draw_episode(simulator, state)
    assert image.shape == (82 * 5, 162 * 5, 3)  # cells of 5 x 5 pixels: 6 would be wider than 960
    assert image.dtype == np.uint8
    assert colour_at(simulator, image, 1.9, 1.0) == render.ROBOT_COLOUR
    assert colour_at(simulator, image, 4.0, 1.3) == seen(render.FREE_COLOUR)
    assert colour_at(simulator, image, 1.0, 1.0) == render.UNKNOWN_COLOUR  # behind it
    assert colour_at(simulator, image, 4.0, -0.02) == render.WALL_COLOUR  # the wall that it stands by is below it
    assert colour_at(simulator, image, 7.5, 3.5) == render.UNKNOWN_COLOUR  # too far away
    assert tuple(image[0, 0].tolist()) == render.UNKNOWN_COLOUR


def test_the_heading_is_seen() -> None:
    for heading in (0.0, 90.0, 200.0):
        simulator, state = started(replace(EAST, start=replace(EAST.start, x_m=4.0, y_m=2.0, heading_deg=heading)))
        image, angle = draw_episode(simulator, state), math.radians(heading)
        for way, colour in ((0.08, render.FREE_COLOUR), (-0.12, render.ROBOT_COLOUR)):
            assert colour_at(simulator, image, 4 + way * math.cos(angle), 2 + way * math.sin(angle)) == colour


def test_the_truth_can_be_shown_alone_or_pale_below_the_map() -> None:
    cupboard = Obstacle(Rectangle(0.5, 0.5), 1.0, 3.0)
    simulator, state = started(replace(EAST, obstacles=ObstaclesConfig((cupboard,))))
    truth, both, known = (draw_episode(simulator, state, shows=shows) for shows in ("truth", "both", "map"))
    assert colour_at(simulator, truth, 1.0, 1.0) == render.FREE_COLOUR
    assert colour_at(simulator, both, 1.0, 1.0) == render.UNKNOWN_COLOUR
    assert colour_at(simulator, truth, 1.0, 3.0) == render.THING_COLOUR
    assert colour_at(simulator, both, 1.0, 3.0) == render.HIDDEN_THING_COLOUR
    assert colour_at(simulator, known, 1.0, 3.0) == render.UNKNOWN_COLOUR
    assert tuple(both[0, 0].tolist()) == render.HIDDEN_COLOUR
    assert tuple(truth[0, 0].tolist()) == render.WALL_COLOUR


def test_what_moves_is_on_the_map_where_the_robot_sees_it() -> None:
    simulator, state = started(replace(EAST, trajectories=(resting(4, 2), resting(1, 2))))
    known, both, truth = (draw_episode(simulator, state, shows=shows) for shows in ("map", "both", "truth"))
    for image in (known, both, truth):
        assert colour_at(simulator, image, 4.0, 2.0) == render.BODY_COLOUR
    assert colour_at(simulator, known, 1.0, 2.0) == render.UNKNOWN_COLOUR
    assert colour_at(simulator, both, 1.0, 2.0) == render.HIDDEN_BODY_COLOUR
    assert colour_at(simulator, truth, 1.0, 2.0) == render.BODY_COLOUR


def test_a_moving_shape_is_drawn_as_it_lies() -> None:
    bar = Trajectory(Rectangle(2.0, 0.2), times_s=(0, 1), poses=((5, 2, 90), (5, 2, 90)))
    simulator, state = started(replace(EAST, trajectories=(bar,)))
    image = draw_episode(simulator, state)
    for y in (1.1, 2.9):
        assert colour_at(simulator, image, 5.0, y) == render.BODY_COLOUR
    assert colour_at(simulator, image, 5.2, 2.0) == render.UNKNOWN_COLOUR  # behind it
    mask = (draw_episode(simulator, state, shows="truth")[2::5, 2::5] == render.BODY_COLOUR).all(axis=2)
    covered = (state.occupied & 2) != 0
    assert (mask & covered).sum() >= 0.95 * covered.sum()
    assert not (mask & ~covered).any()


def test_the_goal_and_the_trail_are_drawn() -> None:
    simulator, state = started(replace(EAST, goal=GoalConfig(random=False, x_m=6.0, y_m=3.0)))
    trail = [state.poses_px.copy()]
    for _ in range(5):
        simulator.step(state, "forward")
        trail.append(state.poses_px.copy())
    image = draw_episode(simulator, state, trail)
    assert colour_at(simulator, image, 6.0, 3.0) == render.GOAL_COLOUR
    assert colour_at(simulator, image, 2.75, 1.0) == render.TRAIL_COLOUR
    assert colour_at(simulator, image, 3.4, 1.0) == render.ROBOT_COLOUR
    assert colour_at(simulator, draw_episode(simulator, state), 2.5, 1.0) == render.FREE_COLOUR


def test_where_odometry_errs_the_map_shows_what_the_robot_believes() -> None:
    simulator, state = started(replace(EAST, noise=NoiseConfig(odometry_deg_per_m=60.0)))
    for _ in range(10):
        simulator.step(state, "forward")
    (x, y, _), (seen_x, seen_y, _) = simulator.pose(state), simulator.believed_pose(state)
    assert math.hypot(x - seen_x, y - seen_y) > 0.6
    for shows, here, there in (("map", (seen_x, seen_y), (x, y)), ("truth", (x, y), (seen_x, seen_y))):
        image = draw_episode(simulator, state, shows=shows)
        assert colour_at(simulator, image, here[0] - 0.1, here[1]) == render.ROBOT_COLOUR
        assert colour_at(simulator, image, there[0] - 0.1, there[1]) != render.ROBOT_COLOUR


def test_small_pictures_keep_walls() -> None:
    simulator, state = started()
    image = draw_episode(simulator, state, most_px=(50, 50))
    assert image.shape == (21, 41, 3)  # a pixel for 4 x 4 cells
    assert colour_at(simulator, image, 5.5, 0.0) == render.WALL_COLOUR
    assert draw_episode(simulator, state, most_px=(1, 1)).shape == (1, 1, 3)


def test_a_pixel_for_several_cells_takes_the_one_that_matters_most() -> None:
    cells = np.array([[0, 1, 1], [0, 2, 1]], np.uint8)
    scale, found = scale_cells(cells, np.array([0, 2, 1], np.uint8), (2, 1))
    assert (scale, found.tolist()) == (0.5, [[1, 1]])
    scale, found = scale_cells(cells, np.array([0, 1, 2], np.uint8), (2, 1))
    assert (scale, found.tolist()) == (0.5, [[2, 1]])
    scale, found = scale_cells(cells[:1], np.arange(3, dtype=np.uint8), (7, 2))
    assert (scale, found.tolist()) == (2.0, [[0, 0, 1, 1, 1, 1]] * 2)


def test_truth_and_map_lie_side_by_side() -> None:
    simulator, state = started()
    for most, each in (((700, 300), (344, 300)), ((350, 700), (350, 344))):  # one below the other where it is narrow
        image = draw_world_and_map(simulator, state, most_px=most)
        truth, known = (draw_episode(simulator, state, shows=shows, most_px=each) for shows in ("truth", "map"))
        rows, cols = truth.shape[:2]
        assert np.array_equal(image[:rows, :cols], truth)
        assert np.array_equal(image[-rows:, -cols:], known)
        assert image.shape[0] <= most[1]
        assert image.shape[1] <= most[0]


def test_what_cannot_be_drawn_is_said() -> None:
    simulator, state = started()
    with pytest.raises(ConfigError, match="shows: expected one of map, both, truth; found 'all'"):
        draw_episode(simulator, state, shows="all")  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="expected a size of at least one pixel, found 0 x 5"):
        draw_episode(simulator, state, most_px=(0, 5))


@pytest.mark.parametrize("task", ["Exploration", "ObstacleAvoidance", "Navigation"])
def test_gymnasium_finds_nothing_wrong_with_pictures(task: str) -> None:
    env = gymnasium.make(f"PseudoSLAM/{task}-v0", dataset=HALL, config=SMALL, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.reset(seed=0)
    frames = [env.render()]
    for _ in range(3):
        env.step(0)
        frames.append(env.render())
    assert len({(frame.shape, frame.dtype) for frame in frames}) == 1
    assert not np.array_equal(frames[0], frames[-1])
    env.reset(seed=0)
    assert np.array_equal(env.render(), frames[0])  # the trail starts anew


def test_without_a_mode_nothing_is_drawn_or_kept() -> None:
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=HALL, config=SMALL).unwrapped
    env.reset(seed=0)
    env.step(0)
    with pytest.warns(UserWarning, match="nothing is drawn without a render_mode"):
        assert env.render() is None
    assert env._trail == []


def test_a_window_shows_each_step_and_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=HALL, config=SMALL, render_mode="human").unwrapped
    env.metadata = {**env.metadata, "render_fps": 1000}
    for _ in range(2):  # it can be opened again
        env.reset(seed=0)
        env.step(0)
        shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
        assert np.array_equal(shown, draw_episode(env.simulator, env.state, env._trail))
        env.close()
        assert not pygame.display.get_init()
    env.close()


def test_a_window_without_pygame_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pygame", None)
    env = gymnasium.make("PseudoSLAM/Exploration-v0", dataset=HALL, config=SMALL, render_mode="human").unwrapped
    with pytest.raises(
        MissingDependencyError, match=r"a window needs pygame: in a clone of the project, pip install -e '.\[play\]'"
    ):
        env.reset(seed=0)
