"""A robot that explores by itself: to the nearest place from which it can see beyond the edge of what it knows."""

from __future__ import annotations

import math
from collections.abc import Iterator

import cv2
import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from houseexpo.pseudoslam.kernels.mapping.merge import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.motion.disc import free_way
from houseexpo.pseudoslam.kernels.sensing.ranges import cast
from houseexpo.pseudoslam.simulator import Action, Simulator
from houseexpo.pseudoslam.state import State

Grid = npt.NDArray[np.uint8]
Cell = tuple[int, int]

_TRIES, _APART_M = 8, 0.3  # how often a cell is looked for, from places so far apart
_NEAR_M = 0.5  # it goes on as long as there are edges so near to the one that it goes for
_LONG_M = 0.4  # edges so long come first
_MAX = 48  # edge cells that are looked at in one plan
_OFFSETS = ((0, 1, 1.0), (1, 0, 1.0), (1, 1, math.sqrt(2)), (1, -1, math.sqrt(2)))
_FAR = 1e9


def frontier_walk(simulator: Simulator, state: State) -> Iterator[Action]:
    """Yield actions by what the map shows at the time; take each before asking for the next.

    It looks round once, then goes on until no unknown cell beside a free one is left that it could see from where it
    can go, to the nearest long edges first and to specks in the end; cells that stay unknown from eight places are
    given up.
    """
    config = simulator.config
    for _ in range(math.ceil((360.0 - config.laser.fov_deg) / config.robot.turn_deg - 1e-9)):
        yield "left"
    failed: dict[Cell, list[tuple[float, float]]] = {}
    while True:
        plan = _plan(simulator, state, failed)
        if plan is None:
            return
        field, watched = plan
        steps = 0
        for action in _go_and_see(simulator, state, field, watched):
            yield action
            steps += 1
        if not steps:  # somebody is in the way
            yield "left"
        if state.known[watched] == UNKNOWN:
            failed.setdefault(watched, []).append((float(state.pose_px[0]), float(state.pose_px[1])))


def _go_and_see(simulator: Simulator, state: State, field: npt.NDArray[np.float32], watched: Cell) -> Iterator[Action]:
    """Go down the field of distances until there is no edge left near the watched cell; turn towards it at the end."""
    turn = math.radians(simulator.config.robot.turn_deg)
    near_px = int(_NEAR_M * simulator.config.pixels_per_metre)
    while _edge_is_near(state.known, watched, near_px):
        turns = _best_turns(simulator, state, field)
        if turns is None:
            break
        for _ in range(abs(turns)):
            yield "left" if turns > 0 else "right"
            if not _edge_is_near(state.known, watched, near_px):
                return
        yield "forward"
    x, y, heading = state.pose_px
    towards = math.atan2(y - watched[0] - 0.5, watched[1] + 0.5 - x)
    turns = round(math.remainder(towards - heading, 2 * math.pi) / turn)
    for _ in range(abs(turns)):
        if state.known[watched] != UNKNOWN:
            return
        yield "left" if turns > 0 else "right"


def _best_turns(simulator: Simulator, state: State, field: npt.NDArray[np.float32]) -> int | None:
    """Return the turns (left above 0) before the step that goes down the field most an action; None: it is there."""
    robot, ppm = simulator.config.robot, simulator.config.pixels_per_metre
    x, y, heading = state.pose_px
    here = float(field[int(y), int(x)])
    if here == 0.0:
        return None
    occupied = _blocked(state, robot.radius_m * ppm)
    turn, step = math.radians(robot.turn_deg), robot.step_m * ppm
    half_way_round = int(math.pi / turn)
    best: tuple[bool, float, int] | None = None
    for turns in range(-half_way_round, half_way_round + 1):
        right, down = math.cos(heading + turns * turn), -math.sin(heading + turns * turn)
        way = free_way(occupied, x, y, right, down, step, robot.radius_m * ppm)
        gain = here - float(field[int(y + way * down), int(x + way * right)])
        option = (way == step, gain / (1 + abs(turns)), turns)
        if gain > 0.5 and (best is None or option > best):
            best = option
    return best[2] if best else None


def _plan(
    simulator: Simulator, state: State, failed: dict[Cell, list[tuple[float, float]]]
) -> tuple[npt.NDArray[np.float32], Cell] | None:
    """Return the distances to the places from which unknown cells are seen, and the one seen from the nearest.

    Long edges are looked for first, then all.
    """
    rows, cols = np.nonzero(edges := _edges(state.known))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(edges.view(np.uint8), connectivity=8)
    is_long = stats[labels[rows, cols], cv2.CC_STAT_AREA] >= _LONG_M * simulator.config.pixels_per_metre
    for wanted, through in ((is_long, False), (~is_long, False), (is_long | True, True)):
        cells = zip(rows[wanted].tolist(), cols[wanted].tolist(), strict=True)
        left = [cell for cell in cells if len(failed.get(cell, ())) < _TRIES]
        plan = _plan_for(simulator, state, left[:: len(left) // _MAX + 1], failed, through)
        if plan is not None:
            return plan
    return None


def _plan_for(
    simulator: Simulator, state: State, edges: list[Cell], failed: dict[Cell, list[tuple[float, float]]], through: bool
) -> tuple[npt.NDArray[np.float32], Cell] | None:
    """Do as ``_plan`` for some unknown cells."""
    ppm = simulator.config.pixels_per_metre
    occupied = _blocked(state, simulator.config.robot.radius_m * ppm)
    room = _room(occupied, simulator.config.robot.radius_m * ppm)
    rows, cols = room.shape
    number = np.full(room.size, -1)
    nodes = np.flatnonzero(room)
    number[nodes] = np.arange(len(nodes))
    opaque = (state.known == OBSTACLE).astype(np.uint8) if through else occupied
    seen_from = np.full(len(nodes), -1)  # which edge
    for i, edge in enumerate(edges):
        places = _in_sight(opaque, edge, 0.9 * simulator.config.laser.range_m * ppm)
        for x, y in failed.get(edge, ()):
            places = places[np.hypot(places % cols + 0.5 - x, places // cols + 0.5 - y) > _APART_M * ppm]
        places = number[places]
        seen_from[places[places >= 0]] = i
    goals = np.flatnonzero(seen_from >= 0)
    if not len(goals):
        return None
    distance, _, nearest = dijkstra(_graph(room, number), False, goals, True, min_only=True)
    field = np.full((rows, cols), _FAR, np.float32)
    field.ravel()[nodes] = np.minimum(distance, _FAR)
    for _ in range(3):  # the robot need not stand in the middle of a cell
        field = np.where(field < _FAR, field, cv2.erode(field, np.ones((5, 5), np.uint8)) + 4.0)
    x, y = state.pose_px[:2]
    away = np.hypot(nodes // cols + 0.5 - y, nodes % cols + 0.5 - x)
    away[~np.isfinite(distance)] = np.inf
    start = int(away.argmin())
    return (field, edges[seen_from[nearest[start]]]) if np.isfinite(away[start]) else None


def _in_sight(occupied: Grid, cell: Cell, range_px: float) -> npt.NDArray[np.int64]:
    """Flat indices of the cells that are seen from the middle of a solid one, or nearly."""
    x, y = cell[1] + 0.5, cell[0] + 0.5
    before, occupied[cell] = occupied[cell], 0
    angles = np.linspace(0, 2 * math.pi, int(4 * math.pi * range_px))  # half a cell apart at the end
    ranges = np.empty(len(angles))
    cast(occupied, x, y, 0.0, np.cos(angles), np.sin(angles), range_px, ranges)
    occupied[cell] = before
    corners = np.stack([x - 0.5 + ranges * np.cos(angles), y - 0.5 - ranges * np.sin(angles)], axis=1).round()
    corners = corners.clip(0, (occupied.shape[1] - 1, occupied.shape[0] - 1))
    left, top = corners.min(axis=0).astype(int)
    right, bottom = corners.max(axis=0).astype(int)
    seen = np.zeros((bottom - top + 1, right - left + 1), np.uint8)
    cv2.fillPoly(seen, [(corners - (left, top)).astype(np.int32)], 1)
    rows, cols = np.nonzero(seen)
    places: npt.NDArray[np.int64] = (rows + top) * occupied.shape[1] + cols + left
    return places


def _graph(room: Grid, number: npt.NDArray[np.int64]) -> coo_matrix:
    """Neighbouring cells, joined by their distance, which is longer near walls."""
    cost = 1.0 + 4.0 / (1.0 + cv2.distanceTransform(room, cv2.DIST_L2, 3))
    rows, cols = np.nonzero(room)
    froms, tos, lengths = [], [], []
    for down, right, length in _OFFSETS:
        inside = (rows + down < room.shape[0]) & (cols + right < room.shape[1]) & (cols + right >= 0)
        r, c = rows[inside], cols[inside]
        both = room[r + down, c + right] != 0
        r, c = r[both], c[both]
        froms.append(number[r * room.shape[1] + c])
        tos.append(number[(r + down) * room.shape[1] + c + right])
        lengths.append(length * (cost[r, c] + cost[r + down, c + right]) / 2)
    size = len(rows)
    return coo_matrix((np.concatenate(lengths), (np.concatenate(froms), np.concatenate(tos))), (size, size)).tocsr()


def _blocked(state: State, radius_px: float) -> Grid:
    """1 where the robot must not go for what it knows; unknown cells that it stands on are free."""
    occupied: Grid = (state.known != FREE).astype(np.uint8)
    x, y = state.pose_px[:2]
    top, left = max(int(y - radius_px) - 1, 0), max(int(x - radius_px) - 1, 0)
    bottom, right = int(y + radius_px) + 2, int(x + radius_px) + 2
    occupied[top:bottom, left:right] = state.known[top:bottom, left:right] == OBSTACLE
    occupied[[0, -1]] = occupied[:, [0, -1]] = 1
    return occupied


def _room(occupied: Grid, radius_px: float) -> Grid:
    """1 where the robot fits in the middle of a cell."""
    reach = math.ceil(radius_px)
    offsets = np.maximum(np.abs(np.arange(-reach, reach + 1)) - 0.5, 0.0)
    disc = (np.hypot(offsets[:, None], offsets) < radius_px - 1e-9).astype(np.uint8)
    taken = cv2.dilate(occupied, disc, borderType=cv2.BORDER_CONSTANT, borderValue=1)
    return np.asarray(taken == 0).view(np.uint8)


def _edges(known: Grid) -> npt.NDArray[np.bool_]:
    """Unknown cells beside free ones."""
    free = (known == FREE).astype(np.uint8)
    beside = cv2.dilate(free, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))) != 0
    return np.asarray((known == UNKNOWN) & beside)


def _edge_is_near(known: Grid, cell: Cell, near_px: int) -> bool:
    top, left = max(cell[0] - near_px, 0), max(cell[1] - near_px, 0)
    return bool(_edges(known[top : cell[0] + near_px + 1, left : cell[1] + near_px + 1]).any())
