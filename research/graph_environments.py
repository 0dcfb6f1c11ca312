"""Run explorers inside the environments of DARE and ARiADNE: moves between nodes of a graph, a scan at each node.

    python -m research.graph_environments dare|ariadne CHECKOUT [--policy frontier,information,chooser] [--maps 20]

CHECKOUT is a clone of marmotlab/DARE or marmotlab/ARiADNE. Map, laser, graph, utilities and the end of an episode are
those of its code, which is imported and not copied; it needs the packages that it needs there.

R1  A policy chooses a frontier of the known map as it does elsewhere, with a laser of 20 m all round. It chooses again
    when the frontier is known.
R2  The robot goes to the node with utility that is nearest to the frontier's goal by a way on the map, along the
    shortest path of the graph. Of equal paths, it takes the one with more nodes, at which it scans.
R3  A frontier that is still unknown from that node is given up. Without a frontier, the nearest node with utility is
    next.
R4  An episode ends as there: in DARE when no node has utility, in ARiADNE also when at most 250 free cells are unseen.
    Their limit is 128 moves; here it is 256, and both numbers are reported.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse.csgraph import dijkstra

from houseexpo.errors import ConfigError
from houseexpo.pseudoslam.agents.explorers import Explorer
from houseexpo.pseudoslam.agents.loading import load_policy
from houseexpo.pseudoslam.agents.protocol import Knowledge, Robot
from houseexpo.pseudoslam.config import LaserConfig, RobotConfig, SimulatorConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE, UNKNOWN
from houseexpo.pseudoslam.kernels.planning.frontiers import find_frontiers
from houseexpo.pseudoslam.kernels.planning.planner_types import FRONTIER
from houseexpo.pseudoslam.kernels.tolerances import MAX_FRONTIERS
from houseexpo.pseudoslam.kernels.types import NO_WAY
from houseexpo.pseudoslam.planning import MapPlanner, explorer_frontier_rules
from houseexpo.pseudoslam.step_kernels import enlarge_scratch

Floats = npt.NDArray[np.float64]
Grid = npt.NDArray[np.uint8]
THEIR_MOVES, MOVES, SHARES = 128, 256, (0.9, 0.95, 0.99)


class OldArray(np.ndarray):
    """An array with what NumPy 2 dropped and their code uses: ``itemset``, and a list that differs from any array."""

    def itemset(self, at: tuple[int, int], value: float) -> None:
        self[at] = value

    def __ne__(self, other: object) -> Any:
        return True if isinstance(other, list) else super().__ne__(other)

    __hash__ = None


class Graph(NamedTuple):
    """The nodes of an environment: places in cells (n, 2), lengths of edges in metres (n, n), utilities (n,)."""

    cells: Floats
    lengths: Floats
    utility: Floats


class Dare:
    """An episode of marmotlab/DARE, as in ``test_worker.py``.

    ``belief`` is the map (rows, cols): 127 unknown, 255 free, 1 occupied. ``truth`` is the house, ``cell`` the robot's
    (x, y), ``metres`` its way.
    """

    cell_m = 0.4

    def __init__(self, number: int) -> None:
        module = importlib.import_module("classes.env.env")
        _give_old_arrays(module)
        manager = importlib.import_module("classes.agent.node_manager").NodeManager()
        self._to_cells = importlib.import_module("classes.utils").get_cell_position_from_coords
        self._env = module.Env(number, 1, plot=False, test=True)
        self._agent = importlib.import_module("classes.agent.agent").Agent(0, manager)
        self._scan()

    def _scan(self) -> None:
        self._agent.update_graph(self._env.belief_info, self._env.robot_locations[0].copy())
        self._nodes = [node.data for node in self._agent.node_manager.nodes_dict]
        self.metres, self.done = float(self._agent.travel_dist), not any(node.utility for node in self._nodes)
        self.belief, self.truth = np.asarray(self._env.robot_belief), self._env.ground_truth
        self.cell = self._cells(self._env.robot_locations[0])[0]

    def _cells(self, places: Any) -> Floats:
        return np.asarray(self._to_cells(np.asarray(places), self._env.belief_info), np.float64).reshape(-1, 2)

    def graph(self) -> Graph:
        """Return the graph of the agent's nodes."""
        places = np.array([node.coords for node in self._nodes])
        number = {tuple(place): n for n, place in enumerate(places.tolist())}
        lengths = np.zeros((len(places), len(places)))
        for n, node in enumerate(self._nodes):
            beside = [number[place] for place in map(tuple, np.asarray(node.neighbor_list).tolist()) if place in number]
            lengths[n, beside] = np.linalg.norm(places[n] - places[beside], axis=1)
        return Graph(self._cells(places), lengths, np.array([node.utility for node in self._nodes]))

    def move(self, node: int) -> None:
        """Go to a node of the last graph."""
        self._env.step(np.array(self._nodes[node].coords), 0)
        self._scan()


class Ariadne:
    """An episode of marmotlab/ARiADNE, as in ``test_worker.py``, with the attributes of ``Dare``."""

    cell_m = 0.25

    def __init__(self, number: int) -> None:
        module = importlib.import_module("env")
        _give_old_arrays(module)
        self._env = module.Env(map_index=number, k_size=20, test=True)
        self.cell, self._gone, self.done = self._env.start_position, 0.0, False
        self._look()

    def _look(self) -> None:
        self.metres = self._gone * self.cell_m
        self.belief, self.truth = np.asarray(self._env.robot_belief), self._env.ground_truth

    def graph(self) -> Graph:
        """Return the graph."""
        places = np.asarray(self._env.node_coords, np.float64)
        lengths = np.zeros((len(places), len(places)))
        for name, edges in self._env.graph.items():
            beside = [int(to) for to in edges]
            lengths[int(name), beside] = np.linalg.norm(places[int(name)] - places[beside], axis=1) * self.cell_m
        return Graph(places, lengths, np.asarray(self._env.node_utility))

    def move(self, node: int) -> None:
        """Go to a node of the last graph."""
        _, self.done, self.cell, self._gone = self._env.step(self.cell, self._env.node_coords[node], self._gone)
        self._look()


def _give_old_arrays(module: Any) -> None:
    """Let a module use ``OldArray`` in its scans and frontiers."""
    np.lib.pad = np.pad  # type: ignore[attr-defined]  # NumPy 2 dropped it, too
    if hasattr(module, "is_old"):
        return
    module.is_old, scan = True, module.sensor_work
    module.sensor_work = lambda at, reach, belief, truth: np.asarray(scan(at, reach, belief.view(OldArray), truth))
    if hasattr(module.Env, "find_frontier"):
        find = module.Env.find_frontier
        module.Env.find_frontier = lambda env: find(env).view(OldArray)


class GraphExplorer:
    """A policy that goes from node to node (R1 to R3)."""

    def __init__(self, name: str, cell_m: float) -> None:
        robot = RobotConfig(cell_m / 4, 2 * cell_m)  # it can stand in each free cell
        config = SimulatorConfig(1.0 / cell_m, robot, LaserConfig(20.0, 360.0))
        policy = load_policy(name).factory(Robot(config), 0)
        if not isinstance(policy, Explorer):
            raise ConfigError(f"--policy: expected policies that choose frontiers, found {name!r}")
        self._policy, self._rules = policy, explorer_frontier_rules(config)
        self._table, self._planner = np.zeros(MAX_FRONTIERS, FRONTIER), MapPlanner(config)
        self._given_up: list[int] = []
        self._target, self._goal, self._moves, self._stop = -1, -1, 0, np.zeros(2)

    def next(self, env: Dare | Ariadne, graph: Graph) -> int:
        """Return the next node."""
        known = np.select([env.belief == 255, env.belief == 1], [FREE, OBSTACLE], UNKNOWN).astype(np.uint8)
        here = int(np.argmin(np.linalg.norm(graph.cells - env.cell, axis=1)))
        ways, before = dijkstra(graph.lengths + 1e-6 * graph.lengths**2, indices=here, return_predecessors=True)  # R2
        others = np.isfinite(ways) & (np.arange(len(ways)) != here)
        useful = np.flatnonzero(others & (graph.utility > 0) if (others & (graph.utility > 0)).any() else others)
        if self._target >= 0 and known.flat[self._target] == UNKNOWN and (self._stop == env.cell).all():
            self._given_up.append(self._target)  # R3
            self._target = -1
        if self._target < 0 or known.flat[self._target] != UNKNOWN:
            self._choose(known, env)  # R1
        away = ways[useful]
        if self._target >= 0:
            row, col = divmod(self._goal, known.shape[1])
            self._planner.find_distances(known, col + 0.5, row + 0.5)
            to_goal = self._planner.ways[tuple(graph.cells[useful].astype(int).T[::-1])]
            away = np.where((to_goal >= 0) & (to_goal < NO_WAY), to_goal, NO_WAY + away)
        node = int(useful[np.argmin(away)])
        self._stop, self._moves = graph.cells[node].copy(), self._moves + 1
        while before[node] != here:
            node = int(before[node])
        return node

    def _choose(self, known: Grid, env: Dare | Ariadne) -> None:
        x, y = (env.cell + 0.5).tolist()
        policy = self._policy
        policy.scratch = enlarge_scratch(policy.scratch, known.size)
        given_up = np.array(self._given_up, np.int32)
        n = find_frontiers(known, x, y, self._rules, given_up, policy.scratch, self._table)
        self._target = -1
        if n:
            pose = np.array([x, y, 0.0])
            info = Knowledge(map=known, pose_px=pose, collided=False, steps=self._moves, path_m=env.metres)
            chosen = self._table[policy.choose(known, self._table[:n], info)]
            self._target, self._goal = int(chosen["middle"]), int(chosen["goal"])


def explore(kind: type[Dare | Ariadne], number: int, name: str) -> dict[str, float]:
    """Return the metres to each share of the free cells, or NaN, and to the end; the moves, and whether it ended."""
    env = kind(number)
    policy, free = GraphExplorer(name, env.cell_m), env.truth == 255
    found, moves = dict.fromkeys(map(str, SHARES), np.nan), 0
    while not env.done and moves < MOVES:
        env.move(policy.next(env, env.graph()))
        moves += 1
        seen = np.count_nonzero(free & (env.belief == 255)) / np.count_nonzero(free)
        for share in SHARES:
            if seen >= share and np.isnan(found[str(share)]):
                found[str(share)] = env.metres
    return {**found, "end": env.metres, "moves": moves, "done": env.done, "in 128": env.done and moves <= THEIR_MOVES}


def main() -> None:
    """Explore maps with each policy, and print a row for each episode, and the means."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("environment", choices=("dare", "ariadne"))
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--policy", default="frontier,information,chooser")
    parser.add_argument("--maps", type=int, default=20)
    options = parser.parse_args()
    checkout = options.checkout.resolve()
    sys.path.insert(0, str(checkout))
    kind: type[Dare | Ariadne] = Dare if options.environment == "dare" else Ariadne
    with tempfile.TemporaryDirectory() as folder:
        if kind is Ariadne:  # its tests read the folder "test"; here they read that of the track ``ariadne``
            (Path(folder) / "DungeonMaps").mkdir()
            (Path(folder) / "DungeonMaps/test").symlink_to(checkout / "DungeonMaps/complex")
        os.chdir(folder if kind is Ariadne else checkout)
        for name in options.policy.split(","):
            rows = []
            for number in range(options.maps):
                rows.append(explore(kind, number, name))
                print(name, number, {key: round(value, 2) for key, value in rows[-1].items()}, flush=True)  # noqa: T201
            print(name, "mean", {key: round(float(np.nanmean([row[key] for row in rows])), 2) for key in rows[0]})  # noqa: T201


if __name__ == "__main__":
    main()
