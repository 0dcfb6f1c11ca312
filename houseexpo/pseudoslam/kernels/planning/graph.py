"""Build a graph of places where the robot can stand by its map, with the frontiers visible from each (as in ARiADNE).

R1  The map is divided into blocks of cells. A block's node is the standing cell with a path to it that is closest to
    the block's centre; of several, the first in row order.
R2  Nodes are sorted by their distance, so that the first is the robot's own; of equal distances, the first block comes
    first. If there are too many nodes, the last ones are left out.
R3  A node's neighbours are nodes at most two blocks away to which a straight line over standing cells leads. They are
    sorted by distance, and of equal distances the first node comes first. Their number is limited.
R4  A node's utility is the length of visible frontiers: cells of frontiers within the laser's range to which a line
    over free cells leads. If there are many cells, only every n-th is checked, and counts n times.
R5  A node is visited if an action ended, or the episode began, in its block.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from houseexpo.pseudoslam.kernels.planning.frontiers import line_is_free, list_frontier_cells
from houseexpo.pseudoslam.kernels.planning.paths import line_is_traversable
from houseexpo.pseudoslam.kernels.planning.planner_types import Graph, GraphRules
from houseexpo.pseudoslam.kernels.tolerances import NODE_BLOCKS, NODE_LOOKS
from houseexpo.pseudoslam.kernels.types import NO_WAY, Cells, Grid, PathScratch


@njit(cache=True, nogil=True)
def build_graph(known: Grid, graph: Graph, rules: GraphRules, given_up: Cells, found: PathScratch) -> None:
    """Compute the graph of a map for which all distances have been computed.

    Parameters
    ----------
    known
        (rows, cols), the map.
    given_up
        Cells that no longer count as frontiers.
    found
        The distances (``find_distances``).
    """
    n = _find_nodes(known, graph, rules, found)
    _link(known.shape[1], graph, rules, n, found)
    _value(known, graph, rules, n, given_up, found)


@njit(cache=True, nogil=True)
def _find_nodes(known: Grid, graph: Graph, rules: GraphRules, found: PathScratch) -> int:
    """Write the nodes (R1, R2); return their number."""
    cols = known.shape[1]
    side, box, ways = rules.block_px, found.box, found.ways
    first_row, first_col = box[0] // side, box[2] // side
    high = max((box[1] + side - 1) // side - first_row, 0)
    wide = max((box[3] + side - 1) // side - first_col, 0)
    cells, lengths = np.empty(high * wide, np.int64), np.empty(high * wide, np.int64)
    n = 0
    for i in range(high * wide):
        top, left = (first_row + i // wide) * side, (first_col + i % wide) * side
        best, least = np.int64(-1), np.int64(0)
        for row in range(max(top, box[0]), min(top + side, box[1])):
            for col in range(max(left, box[2]), min(left + side, box[3])):
                way = ways[row * cols + col]
                off = (2 * (row - top) - side + 1) ** 2 + (2 * (col - left) - side + 1) ** 2
                if way >= 0 and way != NO_WAY and (best < 0 or off < least):
                    best, least = row * cols + col, off
        if best >= 0:
            at = n
            while at > 0 and lengths[at - 1] > ways[best]:  # R2
                cells[at], lengths[at] = cells[at - 1], lengths[at - 1]
                at -= 1
            cells[at], lengths[at] = best, ways[best]
            n += 1
    n = min(n, len(graph.nodes))
    blocks = (cols + side - 1) // side
    for k in range(len(graph.nodes)):
        node = graph.nodes[k]
        node.cell, node.way, node.utility, node.visited = -1, 0, 0, 0
        if k < n:
            node.cell, node.way = cells[k], lengths[k]
            block = node.cell // cols // side * blocks + node.cell % cols // side
            for j in range(min(graph.state[0].visits, len(graph.visited))):
                if graph.visited[j] == block:
                    node.visited = 1
                    break
    graph.state[0].nodes = n
    return n


@njit(cache=True, nogil=True)
def _link(cols: int, graph: Graph, rules: GraphRules, n: int, found: PathScratch) -> None:
    """Write each node's neighbours (R3), -1 after the last one."""
    side, room = rules.block_px, graph.edges.shape[1]
    near = np.empty(room, np.int64)
    graph.edges[:] = -1
    for i in range(n):
        cell = graph.nodes[i].cell
        row, col = cell // cols, cell % cols
        count = 0
        for j in range(n):
            other = graph.nodes[j].cell
            r, c = other // cols, other % cols
            if i == j or max(abs(r // side - row // side), abs(c // side - col // side)) > NODE_BLOCKS:
                continue
            off = (r - row) ** 2 + (c - col) ** 2
            if count == room and off >= near[room - 1]:
                continue
            if not line_is_traversable(found, col + 0.5, row + 0.5, c + 0.5, r + 0.5, cols):
                continue
            at = min(count, room - 1)
            while at > 0 and off < near[at - 1]:
                near[at], graph.edges[i, at] = near[at - 1], graph.edges[i, at - 1]
                at -= 1
            near[at], graph.edges[i, at] = off, j
            count = min(count + 1, room)


@njit(cache=True, nogil=True)
def _value(known: Grid, graph: Graph, rules: GraphRules, n: int, given_up: Cells, found: PathScratch) -> None:
    """Write the nodes' utilities (R4)."""
    cols = known.shape[1]
    edges = found.queue[0]
    n_edges = list_frontier_cells(known, rules.spare_px, given_up, found)
    stride = (n_edges + NODE_LOOKS - 1) // NODE_LOOKS
    for i in range(n):
        cell, seen = graph.nodes[i].cell, 0
        row, col = cell // cols, cell % cols
        for k in range(0, n_edges, max(stride, 1)):
            to_row, to_col = edges[k] // cols, edges[k] % cols
            off = (to_row - row) ** 2 + (to_col - col) ** 2
            if off <= rules.range_px * rules.range_px and line_is_free(known, row, col, to_row, to_col):
                seen += stride
        graph.nodes[i].utility = seen


@njit(cache=True, nogil=True)
def record_visit(graph: Graph, x: float, y: float, cols: int, rules: GraphRules) -> None:
    """Record that the robot has been in the block of a place (R5)."""
    side = rules.block_px
    block = math.floor(y) // side * ((cols + side - 1) // side) + math.floor(x) // side
    for k in range(min(graph.state[0].visits, len(graph.visited))):
        if graph.visited[k] == block:
            return
    graph.visited[graph.state[0].visits % len(graph.visited)] = block
    graph.state[0].visits += 1
