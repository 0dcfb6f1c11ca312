"""Short tours planned with the whole house in view: the upper end of how short a way to a share of it can be.

    python -m research.planned_tours DATASET RESULT [NUMBER]

RESULT is a result of any policy on a track that measures ways to shares (``quality``); its plans and starts are taken.

T1  The robot may stop at nodes, one in each square of ``STEP_M``, or of larger squares if there were more than
    ``MOST_NODES``. It drives from node to node on lines on which its disc passes, and sees all round at each node.
T2  A tour is a list of stops. Stops are added where they show the most cells for the least way, until the share is
    seen; then each is moved to the node that shortens the tour most, and needless ones go.
T3  Some stops are taken out again and the tour is completed anew, ``ROUNDS`` times (ruin and recreate, Schrimpf and
    others, 2000). A slightly longer tour is accepted, ever less so. The seed is the case's.
T4  The last tour is driven along the straightest lines on which the disc passes; where they would show too little, from
    node to node. The robot looks all round each ``LOOK_M``, and all cells are counted. The way is the length at which
    the share is reached. If a tour shows too little then, it is planned again for a larger share.

A turn on the spot is no way. The result has the name ``PLANNED`` and is written beside RESULT. It lies between
``research.way_bounds`` and the ways of policies: any tour is longer than the bound, and the shortest one is not longer
than this tour. With a NUMBER, the means over so many plans are printed and nothing is written.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome, curve_sample_points
from houseexpo.pseudoslam.benchmark.measures import MEAN_DIGITS, StepsToCoverage, Trace
from houseexpo.pseudoslam.benchmark.tracks import Track
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.kernels.mapping import FREE, OBSTACLE
from houseexpo.pseudoslam.kernels.planning.cover import list_visible_cells
from houseexpo.pseudoslam.kernels.planning.paths import find_distances, line_is_traversable, trace_path
from houseexpo.pseudoslam.kernels.types import new_path_scratch
from houseexpo.pseudoslam.step_kernels import make_scratch
from houseexpo.pseudoslam.worlds.world import World
from research.reference_rows import write_reference_row

PLANNED: Final = "planned tour"
STEP_M: Final = 0.5
MOST_NODES: Final = 250
MOST_CELLS: Final = 2048
"""Cells that count while a tour is planned: those of each n-th row and column."""
AROUND: Final = 2
"""Squares to each side to whose nodes a node has a line."""
ROUNDS: Final = 120
TRIED: Final = 0.3
"""Share of the nodes that are tried when a stop is added."""
MOST_OUT: Final = 4
"""Stops that are taken out in a round."""
LONGER: Final = 0.03
"""By which share a tour that is accepted may be longer in the first round."""
MARGINS: Final = (0.001, 0.003, 0.008, 0.02)
"""Of the share, one after the other, until the tour that is driven shows the share itself."""
LOOK_M: Final = 0.1

Bits = npt.NDArray[np.uint64]
Floats = npt.NDArray[np.float64]
Line = npt.NDArray[np.float64]
"""(n, 2), x and y in pixels."""


class TourPlanner:
    """The nodes of a house, the ways between them, and what is seen on these ways; node 0 is the start.

    Parameters
    ----------
    x, y
        The start, pixels.
    """

    def __init__(self, world: World, x: float, y: float, config: SimulatorConfig) -> None:
        ppm = world.frame.pixels_per_metre
        self._world, self._start, self._ppm = world, (x, y), ppm
        self._radius_px, self._range_px = config.robot.radius_m * ppm, config.laser.range_m * ppm
        self._house = np.where(world.occupied != 0, OBSTACLE, FREE).astype(np.uint8)
        self._ways = new_path_scratch(self._house.size)
        find_distances(self._house, x, y, self._radius_px, -1, self._ways)
        self._scratch = make_scratch(config)
        self.nodes = self._find_nodes()
        self._sees, self._lengths = self._find_legs()

    def plan(self, share: float, seed: int, rounds: int = ROUNDS) -> tuple[float, Line] | None:
        """Return the way in metres to a share (0 to 1) of the house, and the line; None if no tour shows so much."""
        for margin in MARGINS:
            stops = self._search(min(share * (1.0 + margin), 1.0), np.random.default_rng(seed), rounds)
            line = None if stops is None else self._line_of(stops, share)
            if line is not None:
                way_m, seen = self.drive(line)
                return float(way_m[np.argmax(seen >= share)]), line
        return None

    def drive(self, line: Line) -> tuple[Floats, Floats]:
        """Return ways along a line in metres (n,), and the share of the house that is seen until each (n,) (T4)."""
        at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        ways = np.unique(np.append(np.arange(0.0, at[-1], LOOK_M * self._ppm), at))
        places = np.stack([np.interp(ways, at, line[:, 0]), np.interp(ways, at, line[:, 1])], axis=1)
        starts, seen = self._look(places, self._world.observable)
        _, first = np.unique(seen, return_index=True)
        new = np.bincount(np.searchsorted(starts, first, side="right") - 1, minlength=len(ways))
        return ways / self._ppm, np.cumsum(new) / np.count_nonzero(self._world.observable)

    def _find_nodes(self) -> Line:
        """Return the start, and in each square the middle of the cell nearest to the square's middle (T1)."""
        reached = np.flatnonzero(self._ways.ways[: self._house.size] >= 0)
        rows, cols = np.divmod(reached, self._house.shape[1])
        side = self._side = max(STEP_M * self._ppm, math.sqrt(len(reached) / MOST_NODES))
        off = (rows % side + 0.5 - side / 2) ** 2 + (cols % side + 0.5 - side / 2) ** 2
        order = np.argsort(off, kind="stable")
        _, first = np.unique(np.stack([rows[order] // side, cols[order] // side]), axis=1, return_index=True)
        cells = order[first]
        nodes = np.vstack([self._start, np.stack([cols[cells] + 0.5, rows[cells] + 0.5], axis=1)])
        while True:  # nodes that no line reaches are reached over the corners of the planner's path
            away = dijkstra(self._lines(nodes), directed=False, indices=0)
            apart = np.flatnonzero(np.isinf(away))
            if not len(apart):
                return nodes
            flat = nodes[apart].astype(int) @ [1, self._house.shape[1]]
            nearest = nodes[apart[self._ways.ways[flat].argmin()]]
            corners = self._straighten(self._path(nodes[0], nearest))
            nodes = np.vstack([nodes, *(self._between(*ends) for ends in itertools.pairwise(corners))])

    def _between(self, one: Line, other: Line) -> Line:
        """Return places on a line, no further apart than a square is wide, with its end but without its start."""
        n = max(1, math.ceil(math.dist(one, other) / self._side))
        return np.linspace(one, other, n + 1)[1:]

    def _look(self, places: Line, wanted: npt.NDArray[np.uint8]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int32]]:
        """Return where the cells that each place sees begin (n + 1,), and these cells, flat indices."""
        cells = (np.floor(places).astype(int) @ [1, wanted.shape[1]]).astype(np.int32)
        starts, room = np.zeros(len(cells) + 1, np.int64), 1 << 20
        occupied, wanted = self._world.occupied.copy(), wanted.copy()
        views = np.empty(room, np.int32)
        while not list_visible_cells(occupied, wanted, cells, self._range_px, self._scratch, starts, views):
            room *= 2
            views = np.empty(room, np.int32)
        return starts, views[: starts[-1]]

    def _find_legs(self) -> tuple[Bits, Floats]:
        """Return what is seen from each node to each other (n, n, words), and the ways' lengths in pixels (n, n)."""
        wanted = self._world.observable
        every = max(1, math.ceil(math.sqrt(np.count_nonzero(wanted) / MOST_CELLS)))
        chosen = np.zeros_like(wanted)
        chosen[::every, ::every] = wanted[::every, ::every]
        number = np.cumsum(chosen.ravel() != 0) - 1
        self._cells = int(number[-1]) + 1
        n, words = len(self.nodes), math.ceil(self._cells / 64)
        seen = np.zeros((n, words * 64), bool)
        starts, cells = self._look(self.nodes, chosen)
        seen[np.repeat(np.arange(n), np.diff(starts)), number[cells]] = True
        views = np.packbits(seen, axis=1).view(np.uint64)
        lengths, before = dijkstra(self._lines(self.nodes), directed=False, return_predecessors=True)
        self._before = before
        sees = np.repeat(views[None], n, axis=0)
        for i in range(n):
            for j in np.argsort(lengths[i], kind="stable").tolist():
                if before[i, j] >= 0:
                    sees[i, j] |= sees[i, before[i, j]]
        one, other = np.triu_indices(n, 1)
        sees[other, one] = sees[one, other]  # of two ways of one length, the same one there and back
        return sees, lengths

    def _lines(self, nodes: Line) -> csr_array:
        """Return the lengths of the lines between near nodes on which the disc passes, pixels (n, n)."""
        squares = np.floor(nodes / self._side).astype(int)
        beside = np.abs(squares[:, None] - squares[None]).max(axis=2) <= AROUND
        pairs = np.argwhere(np.triu(beside, 1))
        ends = nodes[pairs]
        passes = [self._passes(one, other) for one, other in ends.tolist()]
        pairs, ends = pairs[passes], ends[passes]
        lengths = np.maximum(np.hypot(*(ends[:, 0] - ends[:, 1]).T), 1e-9)
        return csr_array((lengths, (pairs[:, 0], pairs[:, 1])), shape=(len(nodes),) * 2)

    def _line_of(self, stops: list[int], share: float) -> Line | None:
        """Return the corners of a line through stops on which a share is seen (T4); None if it shows less."""
        pairs = list(itertools.pairwise(stops))
        over_nodes = [self.nodes[self._nodes_between(a, b)] for a, b in pairs]
        straight = [self._straighten(self._path(self.nodes[a], self.nodes[b])) for a, b in pairs]
        if not pairs or self._share_of(straight) >= share:
            return self._join(straight)
        if self._share_of(over_nodes) < share:
            return None
        legs = over_nodes
        for k in range(len(legs)):
            tried = [*legs[:k], straight[k], *legs[k + 1 :]]
            if self._share_of(tried) >= share:
                legs = tried
        return self._join(legs)

    def _join(self, legs: list[Line]) -> Line:
        return np.vstack([self.nodes[:1], *(leg[1:] for leg in legs)])

    def _share_of(self, legs: list[Line]) -> float:
        return float(self.drive(self._join(legs))[1][-1])

    def _nodes_between(self, one: int, other: int) -> list[int]:
        """Return the nodes from one to another on the way whose views count, with both."""
        first, last = min(one, other), max(one, other)
        nodes = [last]
        while nodes[-1] != first:
            nodes.append(int(self._before[first, nodes[-1]]))
        return nodes if first == other else nodes[::-1]

    def _straighten(self, path: Line) -> Line:
        """Return the corners of a path: from each, the furthest place to which the disc passes on a line."""
        corners, at = [0], 0
        while at < len(path) - 1:
            here = path[at].tolist()
            free = (k for k in range(len(path) - 1, at, -1) if self._passes(here, path[k].tolist()))
            at = next(free, at + 1)
            corners.append(at)
        return path[corners]

    def _passes(self, one: Sequence[float], other: Sequence[float]) -> bool:
        return bool(line_is_traversable(self._ways, one[0], one[1], other[0], other[1], self._house.shape[1]))

    def _path(self, one: Line, other: Line) -> Line:
        """Return the middles of the cells on the planner's shortest path between two places, with both places."""
        ways = new_path_scratch(self._house.size)
        goal = math.floor(other[1]) * self._house.shape[1] + math.floor(other[0])
        x, y = one.tolist()
        find_distances(self._house, x, y, self._radius_px, -1, ways)
        path = np.empty(self._house.size, np.int32)
        cells = path[: trace_path(ways, goal, path)]
        rows, cols = np.divmod(cells, self._house.shape[1])
        return np.vstack([one, np.stack([cols + 0.5, rows + 0.5], axis=1)[1:-1], other])

    def _search(self, share: float, rng: np.random.Generator, rounds: int) -> list[int] | None:
        """Return the stops of a short tour on which a share of the counted cells is seen (T2, T3)."""
        need = math.ceil(share * self._cells - 1e-9)
        reached = np.isfinite(self._lengths[0])
        everything = np.bitwise_or.reduce(self._sees[0][reached], axis=0)
        if _count(everything) < need:
            return None
        now = best = self._shorten(self._complete([0], need, rng), need)
        for k in range(rounds if len(best) > 1 else 0):
            out = min(int(rng.integers(1, MOST_OUT + 1)), len(now) - 1)
            first = int(rng.integers(1, len(now) - out + 1))
            kept = now[:first] + now[first + out :] if k % 2 else _without(now, out, rng)
            if rng.random() < 0.3 and len(kept) > 2:
                one, other = sorted(rng.integers(1, len(kept), 2).tolist())
                kept[one : other + 1] = kept[one : other + 1][::-1]
            tour = self._shorten(self._complete(kept, need, rng), need)
            length = self._length(tour)
            if length < self._length(now) * (1.0 + LONGER * (1.0 - k / rounds)):
                now = tour
            if length < self._length(best) - 1e-9:
                best = tour
        return best

    def _length(self, stops: list[int]) -> float:
        return float(self._lengths[stops[:-1], stops[1:]].sum())

    def _seen_without(self, stops: list[int]) -> tuple[Bits, Bits]:
        """Return what is seen before each stop is left (n, words), and from each stop on (n, words)."""
        legs = np.vstack([self._sees[0, 0][None], self._sees[stops[:-1], stops[1:]]])
        after = np.bitwise_or.accumulate(legs[::-1], axis=0)[::-1]
        return np.bitwise_or.accumulate(legs, axis=0), np.vstack([after[1:], np.zeros_like(legs[:1])])

    def _complete(self, stops: list[int], need: int, rng: np.random.Generator) -> list[int]:
        """Add stops where they show most for the least way, until enough is seen."""
        stops = list(stops)
        while True:
            before, after = self._seen_without(stops)
            short = need - _count(before[-1])
            if short <= 0:
                return stops
            power, best = rng.uniform(0.6, 1.6), (0.0, 0, 0)
            some = np.flatnonzero(rng.random(len(self.nodes)) < TRIED)
            for at in range(len(stops)):  # between this stop and the next, or after the last
                one = stops[at]
                sees = self._sees[one, some] | (before[at] | after[min(at + 1, len(stops) - 1)])
                longer = self._lengths[one, some]
                if at + 1 < len(stops):
                    other = stops[at + 1]
                    sees |= self._sees[other, some]
                    longer = longer + self._lengths[other, some] - self._lengths[one, other]
                gains = np.minimum(_counts(sees) - (need - short), short)
                values = np.where(gains > 0, gains, 0) / (longer + 0.02 * self._side) ** power
                values *= rng.uniform(0.8, 1.0, len(values))
                best = max(best, (float(values.max(initial=0.0)), at, int(some[values.argmax()]) if len(some) else 0))
            if best[0] > 0.0:
                stops.insert(best[1] + 1, best[2])

    def _shorten(self, stops: list[int], need: int) -> list[int]:
        """Take needless stops out and move the others, each to where the tour is shortest, as long as this helps."""
        improved = True
        while improved and len(stops) > 1:
            improved = False
            for at in range(len(stops) - 1, 0, -1):
                before, after = self._seen_without(stops)
                one = stops[at - 1]
                rest = before[at - 1] | (after[at + 1] if at + 1 < len(stops) else after[-1])
                is_last = at + 1 == len(stops)
                if is_last:
                    enough = _count(rest) >= need
                    lengths, sees = self._lengths[one], self._sees[one] | rest
                else:
                    other = stops[at + 1]
                    enough = _count(rest | self._sees[one, other]) >= need
                    lengths, sees = (
                        self._lengths[one] + self._lengths[other],
                        self._sees[one] | self._sees[other] | rest,
                    )
                if enough:
                    del stops[at]
                    improved = True
                    continue
                lengths = np.where(_counts(sees) >= need, lengths, np.inf)
                node = int(lengths.argmin())
                if lengths[node] < lengths[stops[at]] - 1e-6:
                    stops[at] = node
                    improved = True
        return stops


def _without(stops: list[int], number: int, rng: np.random.Generator) -> list[int]:
    """Return a tour without some stops that are drawn; the start stays."""
    out = set(rng.choice(np.arange(1, len(stops)), number, replace=False).tolist())
    return [stop for k, stop in enumerate(stops) if k not in out]


def _counts(bits: Bits) -> npt.NDArray[np.int64]:
    found: npt.NDArray[np.int64] = np.bitwise_count(bits).sum(axis=-1, dtype=np.int64)
    return found


def _count(bits: Bits) -> int:
    return int(np.bitwise_count(bits).sum())


def outcome_of(track: Track, case: Case, ways_m: dict[float, float]) -> EpisodeOutcome:
    """Return the track's measures of the tours of one house; steps have no value."""
    trace = Trace()
    trace.add(0, 0.0, {"coverage": 0.0, "collisions": 0})
    for share, way in sorted(ways_m.items()):
        trace.add(0, max(way, trace.metres[-1]), {"coverage": share, "collisions": 0})
    found = track.measure(trace)
    values = {
        key: round(value, MEAN_DIGITS) if value is not None and key.startswith(("metres_to_", "reached_")) else None
        for key, value in found.items()
    }
    curves = {over: trace.coverage_at(over, curve_sample_points(most)).tolist() for over, most in track.curves}
    return EpisodeOutcome(case, values, curves)


def main() -> None:
    """Write the tours' ways for all plans of a result, or print the means over some of them beside the result's own."""

    def fits(track: Track) -> str:
        has_ways = isinstance(track.measure, StepsToCoverage) and not track.config.noise.any and not track.slam
        return "" if has_ways else "a track that measures ways to shares without noise"

    def find(track: Track, case: Case, world: World, x: float, y: float) -> EpisodeOutcome:
        planner = TourPlanner(world, x, y, track.config)
        shares = [s / 100 for s in track.measure.shares] if isinstance(track.measure, StepsToCoverage) else []
        tours = {share: planner.plan(share, case.seed) for share in shares}
        return outcome_of(track, case, {share: tour[0] for share, tour in tours.items() if tour is not None})

    write_reference_row(PLANNED, "research.planned_tours", fits, find)


if __name__ == "__main__":
    main()
