"""Kinds ``scan5`` and ``scan20``: the inner surface of a furnished home as a scanner sees it.

R1  The air of the rooms, doorways and window niches, less furniture and open leaves, is one solid; its surface is what
    is seen. The ceiling is not.
R2  It is divided into small triangles; each point is moved by noise of 5 or 20 mm, half of it the same over 0.5 m.
R3  A fifth of the triangles is missing, in patches.
"""

from __future__ import annotations

from pathlib import Path

import manifold3d
import numpy as np
import shapely
import trimesh
from numpy.random import Generator
from scipy.spatial import cKDTree

from tests.builders.kinds.homes import Style, random_home
from tests.builders.kinds.parts.furnishing import furnished
from tests.builders.kinds.parts.joinery import leaf_area
from tests.builders.kinds.parts.solids3d import mesh, mesh_of, prism, solid
from tests.builders.kinds.placing import random_placing, truth_of
from tests.builders.kinds.values import LEADS_IN, Member, Part, Storey
from tests.builders.kinds.writers import UP_OF, write

MISSING = 0.2
FUSED = 1.03
"""Furniture is seen as a little larger, so that it grows together with the wall behind it."""


def make_5(rng: Generator, folder: Path, name: str) -> Member:
    """Write a scan with noise of 5 mm."""
    return make(rng, folder, name, 0.005)


def make_20(rng: Generator, folder: Path, name: str) -> Member:
    """Write a scan with noise of 20 mm."""
    return make(rng, folder, name, 0.02)


def make(rng: Generator, folder: Path, name: str, noise_m: float) -> Member:
    """Write one scan."""
    style = Style(size=str(rng.choice(["small", "home"])), outer_m=(0.2, 0.4), height_m=(2.35, 2.9), windows=0.6)
    storey = random_home(rng, style)
    edge = float(rng.uniform(0.1, 0.2))
    surface = patched(noisy(seen(storey, rng, edge), noise_m, rng), rng)
    suffix = str(rng.choice([".ply", ".ply", ".obj", ".glb"]))
    up = "y" if rng.random() < 0.3 else UP_OF[suffix]  # phones write y-up PLY files too
    placing = random_placing(rng, up, turned=0.6)
    path = write([Part("scan", surface, "wall", "scan")], folder / f"{name}{suffix}", placing)
    return Member(
        path,
        (truth_of(storey, placing, "scan", name),),
        f"{len(surface.faces)} faces of {edge:.2f} m",
        placing.up,
        placing.unit_m,
    )


def seen(storey: Storey, rng: Generator, edge: float, *, ceiling: bool = False) -> trimesh.Trimesh:
    """R1: the surface, with edges of at most ``edge`` metres, and with the ceiling if it is asked for."""
    high = storey.height
    rooms = [storey.rooms[k] for k, c in enumerate(storey.cells) if c.floor]
    air = [solid(shapely.union_all([r.buffer(0.005, join_style="mitre") for r in rooms]), 0.0, high)]
    for o in storey.openings:
        if o.kind in LEADS_IN:
            air.append(solid(storey.gap(o, 0.02), 0.0, min(o.head, high)))
        else:
            wall = storey.walls[o.wall]
            side = 1 if wall.sides[0] >= 0 else -1
            niche = wall.strip(o.start, o.end, wall.thickness / 2 + 0.02, side * (wall.thickness / 4 + 0.01))
            air.append(solid(niche, o.sill, min(o.head, high)))
    whole = manifold3d.Manifold.batch_boolean(air, manifold3d.OpType.Add)
    bodies = [b for t in furnished(storey, rng, float(rng.uniform(0.5, 1.0))) for b in closed(t.mesh, t.sort == "lamp")]
    bodies += open_leaves(storey, rng)
    if bodies:
        whole -= manifold3d.Manifold.batch_boolean(bodies, manifold3d.OpType.Add)
    found = mesh_of(whole.refine_to_length(edge))
    above = (found.vertices[found.faces][:, :, 2] > high - 1e-6).all(axis=1)
    faces = found.faces if ceiling else found.faces[~above]
    return trimesh.Trimesh(found.vertices, faces[:, ::-1], process=True)


def closed(thing: trimesh.Trimesh, hanging: bool) -> list[manifold3d.Manifold]:
    """The closed pieces of a thing as solids, FUSED; a hanging lamp is not seen."""
    if hanging:
        return []
    centre = np.append(thing.bounds.mean(axis=0)[:2], 0.0)
    made = []
    for piece in thing.split(only_watertight=True):
        points = (piece.vertices - centre) * (FUSED, FUSED, 1.0) + centre
        points[:, 2] = np.where(points[:, 2] < 0.02, -0.05, points[:, 2])
        body = manifold3d.Manifold(manifold3d.Mesh(points.astype(np.float32), piece.faces.astype(np.uint32)))
        made += [body] if body.status() == manifold3d.Error.NoError else []
    return made


def open_leaves(storey: Storey, rng: Generator) -> list[manifold3d.Manifold]:
    """Leaves that stand open in a room, where there is space for them."""
    made = []
    for o in storey.openings:
        wall = storey.walls[o.wall]
        for leaf in o.leaves if o.kind in LEADS_IN else ():
            area = leaf_area(wall, o, leaf, float(rng.uniform(70, 100)), 0.0)
            room = storey.rooms[wall.sides[0 if leaf.swing == 1 else 1]]
            if area.intersection(room).area > 0.8 * area.area:
                body = prism(area, -0.05, o.head)
                made.append(manifold3d.Manifold(manifold3d.Mesh(body.vertices.astype(np.float32),
                                                                body.faces.astype(np.uint32))))  # fmt: skip
    return made


def noisy(surface: trimesh.Trimesh, noise_m: float, rng: Generator) -> trimesh.Trimesh:
    """R2."""
    points = np.asarray(surface.vertices)
    cells = np.floor(points / 0.5).astype(int)
    _, where = np.unique(cells, axis=0, return_inverse=True)
    common = rng.normal(0.0, 1.0, (int(where.max()) + 1, 3))[where.ravel()]
    own = rng.normal(0.0, 1.0, points.shape)
    return mesh(points + noise_m * (common + own) / np.sqrt(2.0), surface.faces)


def patched(surface: trimesh.Trimesh, rng: Generator) -> trimesh.Trimesh:
    """R3."""
    middles = surface.vertices[surface.faces].mean(axis=1)
    tree, gone = cKDTree(middles), np.zeros(len(middles), bool)
    while gone.mean() < MISSING:
        centre = middles[int(rng.integers(len(middles)))]
        near = np.array(tree.query_ball_point(centre, float(rng.uniform(0.15, 0.5))))
        gone[near] = True
    kept = trimesh.Trimesh(surface.vertices, surface.faces[~gone], process=False)
    kept.remove_unreferenced_vertices()
    return kept
