"""Lines cut on a grid: the same bytes as GEOS makes with a grid, whether the quick way is taken or not."""

import numpy as np
import pytest
import shapely

from pipeline.geometry.areas import are_edges_of, node_on_grid

GRID_M = 1e-4


def plain(lines):
    pieces = shapely.get_parts(shapely.union_all(lines, grid_size=GRID_M))
    return pieces[shapely.get_type_id(pieces) == shapely.GeometryType.LINESTRING]


def rectangles(rng, count, step_m, turned):
    """The sides of rectangles that touch, cross and cover each other, each cut somewhere, as sections come."""
    low = rng.integers(-6, 6, (count, 2)) * step_m
    high = low + rng.integers(1, 6, (count, 2)) * step_m
    corners = np.array([[(x, y), (u, y), (u, v), (x, v)] for (x, y), (u, v) in zip(low, high, strict=True)])
    sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 2)
    cut = sides[:, 0] + rng.uniform(0.1, 0.9, (len(sides), 1)) * (sides[:, 1] - sides[:, 0])
    halves = np.concatenate([np.stack([sides[:, 0], cut], axis=1), np.stack([cut, sides[:, 1]], axis=1)])
    spin = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
    return shapely.linestrings((np.floor(halves @ spin / GRID_M) + 0.363) * GRID_M)


@pytest.mark.parametrize("turned", [0.0, 0.3])
@pytest.mark.parametrize("step_m", [0.5, 0.13, 3e-4])
def test_lines_are_cut_as_geos_cuts_them(turned, step_m):
    rng = np.random.default_rng(3)
    for count in range(1, 20):
        lines = rectangles(rng, count, step_m, turned)
        assert shapely.to_wkb(node_on_grid(lines, GRID_M)).tolist() == shapely.to_wkb(plain(lines)).tolist()


def test_an_end_beside_a_line_cuts_it():
    lines = shapely.linestrings([[(0.0, 0.0), (3.0, 1.0)], [(1.5, 0.50003), (1.5, 2.0)]])
    found = node_on_grid(lines, GRID_M)
    assert len(found) == 3
    assert shapely.to_wkb(found).tolist() == shapely.to_wkb(plain(lines)).tolist()


def test_a_line_that_ends_in_the_open_is_no_edge():
    faces = shapely.polygons([[(0, 0), (2, 0), (2, 1), (0, 1)]])
    sides = shapely.linestrings([[(0, 0), (2, 0)], [(2, 1), (2, 0)], [(2, 1), (0, 1)], [(0, 1), (0, 0)]])
    assert are_edges_of(faces, sides)
    assert not are_edges_of(faces, np.append(sides, shapely.linestrings([(2, 1), (3, 1)])))
    assert not are_edges_of(faces[:0], sides)
