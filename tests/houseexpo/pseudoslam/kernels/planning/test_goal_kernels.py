"""Lengths of paths to a goal, against an exact twin on the same cells and the exact paths in plans."""

from __future__ import annotations

import math

import networkx as nx
import numpy as np
import pytest
import shapely
import shapely.affinity

from houseexpo import FloorPlan
from houseexpo.pseudoslam.kernels.planning.goal_paths import (
    DONE,
    GOAL_CELL,
    SIGN,
    TURN_X,
    TURN_Y,
    CornerGraph,
    GoalPaths,
    X,
    Y,
    find_goal_paths,
    goal_distance_at,
    is_straight,
    make_corner_graph,
    nearest_place,
)
from houseexpo.pseudoslam.worlds.world import make_world
from tests.builders.exact_paths import disc_area, exact_distance

FAR = 1e6


def graph_of(standing: np.ndarray, reach_px: float = FAR) -> CornerGraph:
    """The corners for a robot without a size."""
    return make_corner_graph(standing, np.uint8(1) - standing, 0.0, reach_px)


def paths_to(standing: np.ndarray, x: float, y: float, reach_px: float = FAR) -> GoalPaths:
    return find_goal_paths(graph_of(standing, reach_px), x, y)


def area_of(standing: np.ndarray) -> shapely.Geometry:
    """The squares of the cells, as one shape."""
    rows, cols = np.nonzero(standing)
    return shapely.union_all(shapely.box(cols, rows, cols + 1, rows + 1))


def slow_distance(standing: np.ndarray, start: tuple[float, float], goal: tuple[float, float]) -> float:
    """Dijkstra over all points of the outline that see each other inside the cells."""
    area, graph = area_of(standing).buffer(1e-6, join_style="mitre"), nx.Graph()
    corners = {tuple(point) for point in shapely.get_coordinates(area_of(standing)).tolist()}
    points = [start, goal, *sorted(corners)]
    for i, one in enumerate(points):
        for other in points[i + 1 :]:
            if area.covers(shapely.LineString([one, other])) or one == other:
                graph.add_edge(one, other, weight=math.dist(one, other))
    try:
        return float(nx.dijkstra_path_length(graph, start, goal))
    except (nx.NetworkXNoPath, nx.NodeNotFound):
        return math.inf


def connected(standing: np.ndarray) -> np.ndarray:
    """Only the largest piece, as the cells of a world."""
    import cv2

    _, labels, stats, _ = cv2.connectedComponentsWithStats(standing, connectivity=4)
    return (labels == 1 + stats[1:, cv2.CC_STAT_AREA].argmax()).astype(np.uint8)


@pytest.mark.parametrize("seed", range(6))
def test_it_is_what_its_twin_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    standing = np.zeros((14, 17), np.uint8)
    standing[1:-1, 1:-1] = rng.random((12, 15)) < (0.8 if seed % 2 else 0.65)
    standing = connected(standing)
    for _ in range(4):
        start, goal = (tuple((cell[::-1] + rng.random(2)).tolist()) for cell in rng.choice(np.argwhere(standing), 2))
        paths = paths_to(standing, *goal)
        assert goal_distance_at(paths, *start) == pytest.approx(slow_distance(standing, start, goal), rel=1e-6)


@pytest.mark.parametrize("reach_px", [FAR, 5.0])
def test_corners_are_linked_if_a_path_may_turn_at_both(reach_px: float) -> None:
    """A path may turn at a corner around its closed cell if the line to it, drawn on, passes beside that cell."""
    rng = np.random.default_rng(3)
    standing = np.ones((14, 17), np.uint8)
    standing[1:-1, 1:-1] = rng.random((12, 15)) < 0.8
    graph = graph_of(standing, reach_px)
    number, found = len(graph.corners), 0
    assert graph.starts[0] == 0
    assert graph.starts[-1] == len(graph.others)
    for one in range(number):
        links = graph.others[graph.starts[one] : graph.starts[one + 1]].tolist()
        assert links == sorted(set(links))
        for other in range(number):
            (x, y, sign), (to_x, to_y, to_sign) = (graph.corners[k, [X, Y, SIGN]].tolist() for k in (one, other))
            product = (to_x - x) * (to_y - y)
            wanted = (
                one != other and product * sign >= 0 and product * to_sign >= 0
                and math.dist((x, y), (to_x, to_y)) <= reach_px and is_straight(standing, x, y, to_x, to_y)
            )  # fmt: skip
            assert (other in links) == wanted, (one, other)
            found += wanted
    assert found > 100 if reach_px == FAR else found > 50


def test_goals_of_one_house_do_not_change_its_corners() -> None:
    standing = np.ones((20, 20), np.uint8)
    standing[5:15, 5:15] = 0
    graph = graph_of(standing)
    first = find_goal_paths(graph, 2.5, 2.5)
    for paths in (first, find_goal_paths(graph, 17.5, 9.5), find_goal_paths(graph, 2.5, 2.5)):
        goal_distance_at(paths, 17.5, 17.5)
    assert first.ways.tobytes() == paths.ways.tobytes()
    assert goal_distance_at(paths, 17.5, 17.5) == pytest.approx(2 * math.hypot(12.5, 2.5))


def pillars(rows: int, cols: int) -> np.ndarray:
    """A hall with a pillar of 4 x 4 cells every 20."""
    standing = np.ones((rows, cols), np.uint8)
    for row in range(10, rows, 20):
        for col in range(10, cols, 20):
            standing[row : row + 4, col : col + 4] = 0
    return standing


@pytest.mark.parametrize("seed", range(8))
def test_what_was_searched_before_changes_no_distance(seed: int) -> None:
    """A robot that walks, and one that is now here and now there, against a search for each place alone (R6)."""
    rng = np.random.default_rng(seed)
    if seed % 2:
        standing = pillars(120, 200)
    else:
        standing = np.zeros((60, 80), np.uint8)
        standing[1:-1, 1:-1] = rng.random((58, 78)) < 0.75
        standing = connected(standing)
    graph, cells = graph_of(standing, 100.0), np.argwhere(standing)
    goal, place = (cell[::-1] + 0.5 for cell in rng.choice(cells, 2))
    paths, sure = find_goal_paths(graph, *goal), 0
    for k in range(60):
        before = paths.ways.tobytes()
        if k % 20 == 19:
            place = rng.choice(cells)[::-1] + 0.5
        step = place + rng.uniform(-3, 3, 2)
        if (step > 0).all() and (step < standing.shape[::-1]).all() and standing[int(step[1]), int(step[0])]:
            place = step
        assert goal_distance_at(paths, *place) == goal_distance_at(find_goal_paths(graph, *goal), *place)
        sure += paths.ways.tobytes() == before
    assert sure > 30


def test_only_what_lies_between_the_robot_and_its_goal_is_searched() -> None:
    standing = pillars(600, 800)
    graph = graph_of(standing, 100.0)
    paths = find_goal_paths(graph, 45.5, 31.5)
    assert 200.0 < goal_distance_at(paths, 245.5, 31.5) < 201.0
    assert 0 < np.isfinite(paths.ways[:, DONE]).sum() < 0.1 * len(graph.corners)
    nowhere = pillars(600, 800)
    nowhere[:, 400] = 0
    paths = find_goal_paths(graph_of(nowhere, 100.0), 52.0, 52.0)
    assert goal_distance_at(paths, 752.0, 192.0) == math.inf
    assert paths.sizes["sure_px"] == math.inf


def test_short_lines_lengthen_a_path_hardly() -> None:
    """In a hall of pillars, lines are as long as five pillars are apart, or as long as they can be."""
    standing, rng = pillars(120, 200), np.random.default_rng(0)
    for _ in range(20):
        (x, y), (to_x, to_y) = rng.uniform((0, 0), (200, 120), (2, 2)).tolist()
        exact = goal_distance_at(paths_to(standing, to_x, to_y), x, y)
        short = goal_distance_at(paths_to(standing, to_x, to_y, 100.0), x, y)
        assert exact <= short + 1e-9 or exact == math.inf
        assert short <= 1.005 * exact or exact == math.inf


def test_behind_walls_there_is_no_path() -> None:
    standing = np.ones((5, 9), np.uint8)
    standing[:, 4] = 0
    paths = paths_to(standing, 1.5, 2.5)
    assert goal_distance_at(paths, 7.5, 2.5) == math.inf
    assert goal_distance_at(paths, 3.9, 0.1) < math.inf
    assert goal_distance_at(paths, -5.0, 2.5) == math.inf


def test_in_the_region_of_the_goal_the_distance_is_0() -> None:
    standing = np.ones((5, 9), np.uint8)
    standing[:4, 4] = 0
    paths, plain = paths_to(standing, 1.5, 2.5), paths_to(standing, 1.5, 2.5)
    region = standing.copy()
    region[1:3, 0:3] = GOAL_CELL
    paths = paths._replace(standing=region.ravel())
    for x, y in np.random.default_rng(0).uniform((0, 0), (9, 5), (200, 2)).tolist():
        inside = region[int(y), int(x)] == GOAL_CELL
        assert goal_distance_at(paths, x, y) == (0.0 if inside else goal_distance_at(plain, x, y))


def test_the_nearest_place_is_the_one_with_the_shortest_path() -> None:
    standing = np.ones((5, 9), np.uint8)
    standing[:4, 4] = 0
    places = np.array([(7.5, 0.5), (0.5, 4.5), (7.5, 4.5), (4.5, 0.5)])
    paths = paths_to(standing, 3.5, 0.5)
    found, way = nearest_place(paths, places)
    ways = [goal_distance_at(paths, x, y) for x, y in places.tolist()]
    assert (found, way) == (int(np.argmin(ways)), min(ways))
    assert nearest_place(paths, places[:0]) == (-1, math.inf)


def test_beside_the_cells_it_is_the_path_from_the_nearest_one() -> None:
    standing = np.zeros((9, 9), np.uint8)
    standing[4, 2:7] = 1
    paths = paths_to(standing, 2.5, 4.5)
    assert goal_distance_at(paths, 6.5, 3.5) == pytest.approx(math.hypot(4.0, 1.0))
    assert goal_distance_at(paths, 6.5, 1.0) == math.inf


def test_lines_along_sides_need_an_open_cell_beside_them() -> None:
    standing = np.ones((6, 6), np.uint8)
    standing[2, 2:5] = standing[3, 2:5] = 0
    for line, is_free in (
        ((2.0, 1.0, 2.0, 5.0), True), ((1.0, 2.0, 6.0, 2.0), True), ((1.0, 3.0, 6.0, 3.0), False),
        ((3.0, 0.0, 3.0, 6.0), False), ((1.0, 1.0, 5.5, 5.5), False), ((0.0, 4.0, 6.0, 4.0), True),
    ):  # fmt: skip
        assert is_straight(standing, *line) is is_free, line
        assert is_straight(standing, *line[2:], *line[:2]) is is_free, line


def test_a_disc_turns_around_the_corner_of_a_wall_on_a_circle() -> None:
    """A wall of two cells; the corners of the closed cells around it are moved to the circles around its own."""
    occupied = np.zeros((20, 20), np.uint8)
    occupied[9, 9:11] = 1
    rows, cols = np.mgrid[:20, :20] + 0.5
    standing = np.hypot(np.maximum(np.abs(cols - 10) - 1, 0), np.maximum(np.abs(rows - 9.5) - 0.5, 0)) >= 5.0
    corners = make_corner_graph(standing.astype(np.uint8), occupied, 5.0, FAR).corners
    assert len(corners) > 8
    wall = shapely.box(9, 9, 11, 10)
    turns = shapely.distance(wall, shapely.points(corners[:, [TURN_X, TURN_Y]]))
    assert turns == pytest.approx(5.0)
    moved = np.hypot(corners[:, TURN_X] - corners[:, X], corners[:, TURN_Y] - corners[:, Y])
    assert 0.5 < moved.max() <= math.sqrt(0.5)


@pytest.mark.parametrize("radius_px", [3.2, 5.0, 6.6])
@pytest.mark.parametrize("x", [5.5, 24.5, 29.5])
def test_around_the_end_of_a_wall_the_path_is_an_arc(radius_px: float, x: float) -> None:
    """A wall of one cell in width; straight lines between the corners would be up to 1.7% too short."""
    occupied = np.zeros((60, 60), np.uint8)
    occupied[30, :30] = 1
    rows, cols = np.mgrid[:60, :60] + 0.5
    standing = np.hypot(np.maximum(np.abs(rows - 30.5) - 0.5, 0), np.maximum(cols - 30, 0)) >= radius_px
    graph = make_corner_graph(standing.astype(np.uint8), occupied, radius_px, FAR)
    goal, start = (x, 29.5 - math.ceil(radius_px)), (x, 31.5 + math.ceil(radius_px))
    exact = exact_distance(disc_area(occupied, radius_px), start, goal)
    assert 0.9999 * exact <= goal_distance_at(find_goal_paths(graph, *goal), *start) <= 1.009 * exact


def room_with_pillars(seed: int) -> FloorPlan:
    """A room of 7 x 5 m at an angle, with six walls of 0.1 to 1.4 m in it, each at an angle of its own."""
    rng = np.random.default_rng(seed)
    walls: list[shapely.Polygon] = []
    while len(walls) < 6:
        (x, y, turn), (width, depth) = rng.uniform((0.8, 0.8, 0), (6.2, 4.2, 90)), rng.uniform(0.1, 1.4, 2)
        wall = shapely.affinity.rotate(shapely.box(x, y, x + width, y + depth / 4), turn)
        if all(wall.distance(other) > 0.6 for other in walls) and shapely.box(0.5, 0.5, 6.5, 4.5).contains(wall):
            walls.append(wall)
    turn = rng.uniform(0, 90) if seed % 2 else 0.0
    outline, *holes = (
        list(shapely.affinity.rotate(each, turn, origin=(0, 0)).exterior.coords)[:-1]
        for each in (shapely.box(0, 0, 7, 5), *walls)
    )
    return FloorPlan(str(seed), outline, 1, {}, holes=holes)


@pytest.mark.parametrize("pixels_per_metre", [10.0, 16.0, 25.0, 33.0])
@pytest.mark.parametrize("seed", range(2))
def test_among_cells_it_is_the_path_of_a_disc(seed: int, pixels_per_metre: float) -> None:
    """Within 1% of the exact path of a disc among the occupied cells, for all paths of 1 m and more."""
    world = make_world(room_with_pillars(seed), pixels_per_metre, 0.2, 5.0)
    graph = world.corner_graph(0.2 * pixels_per_metre)
    area = disc_area(world.occupied, 0.2 * pixels_per_metre)
    cells, rng, tried = np.argwhere(world.traversable), np.random.default_rng(seed), 0
    for _ in range(12):
        start, goal = (tuple((cell[::-1] + 0.5).tolist()) for cell in rng.choice(cells, 2))
        if math.dist(start, goal) < pixels_per_metre:
            continue
        found, exact = goal_distance_at(find_goal_paths(graph, *goal), *start), exact_distance(area, start, goal)
        assert found == pytest.approx(exact, rel=0.01)
        tried += found > math.dist(start, goal) + 1e-9
    assert tried > 3


WALLS = {
    "corner": (FloorPlan("l", [(0, 0), (0, 6), (3, 6), (3, 2), (8, 2), (8, 0)], 1, {}), (1.5, 5.5), (7.4, 1.0)),
    "wall": (
        FloorPlan("w", [(0, 0), (0, 5), (8, 5), (8, 0)], 1, {}, holes=[[(4, 1.0), (4.2, 1.0), (4.2, 5), (4, 5)]]),
        (2.0, 4.0), (7.0, 4.0),
    ),
}  # fmt: skip


@pytest.mark.parametrize("pixels_per_metre", [16.0, 20.0, 25.0, 33.0])
@pytest.mark.parametrize("name", WALLS)
def test_in_a_plan_it_is_the_path_of_a_disc(name: str, pixels_per_metre: float) -> None:
    """Within 1% of the shortest path around walls that are grown by the robot's radius."""
    plan, start, goal = WALLS[name]
    world = make_world(plan, pixels_per_metre, 0.2, 5.0)
    (x, y), (to_x, to_y) = world.frame.pixels_from_points([start, goal]).tolist()
    graph = world.corner_graph(0.2 * pixels_per_metre)
    found = goal_distance_at(find_goal_paths(graph, to_x, to_y), x, y) / pixels_per_metre
    room = shapely.Polygon(plan.verts, plan.holes).buffer(-0.2, quad_segs=64)
    assert found == pytest.approx(exact_distance(room, start, goal), rel=0.01)
