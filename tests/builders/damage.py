"""Levels damaged as files are: the houses of the kit are too sound for telling wrong plans from right ones.

One of these, at random; what is known of the house stays true of it.

R1  Holes: all faces around some places are gone. R2  Noise on all vertices. R3  All that stands above a height between
1.9 and 2.3 m is gone, lintels among it. R4  Some bodies are gone. R5  Heights are squeezed or stretched, as where a
unit is wrong in one axis. R6  What the source names is not named. R7  Holes, and no floor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from pipeline.geometry.meshes import Bodies
from pipeline.values import Level, Mesh


def damaged(level: Level, rng: Generator) -> Level:
    """Return a level with one kind of damage."""
    if not len(level.walls.faces):
        return level
    damage = (_holes, _noise, _without_tops, _without_bodies, _squeezed, _unnamed, _holes_without_floor)
    return damage[int(rng.integers(len(damage)))](level, rng)


def _holes(level: Level, rng: Generator) -> Level:
    """R1."""
    faces = level.walls.faces
    centres = level.walls.vertices[faces].mean(axis=1)
    keep = np.ones(len(faces), np.bool_)
    for centre in centres[rng.integers(len(centres), size=int(rng.integers(2, 12)))]:
        keep &= np.hypot(*(centres - centre)[:, :2].T) > rng.uniform(0.2, 0.9)
    return _with(level, faces=faces[keep])


def _noise(level: Level, rng: Generator) -> Level:
    """R2."""
    vertices = level.walls.vertices
    return _with(level, vertices=vertices + rng.normal(0.0, rng.choice([0.01, 0.02, 0.04]), vertices.shape))


def _without_tops(level: Level, rng: Generator) -> Level:
    """R3."""
    vertices, faces, top = level.walls.vertices.copy(), level.walls.faces, float(rng.uniform(1.9, 2.3))
    faces = faces[vertices[faces][:, :, 2].min(axis=1) < top]
    vertices[:, 2] = np.minimum(vertices[:, 2], top)
    return replace(_with(level, vertices, faces), ceiling_m=top)


def _without_bodies(level: Level, rng: Generator) -> Level:
    """R4."""
    bodies, share = Bodies.of(level.walls), rng.choice([0.03, 0.08, 0.15])
    return replace(level, walls=bodies.without([k for k in range(len(bodies.low)) if rng.random() < share]))


def _squeezed(level: Level, rng: Generator) -> Level:
    """R5."""
    return _with(level, vertices=level.walls.vertices * [1.0, 1.0, rng.choice([0.75, 0.85, 1.2, 1.35])])


def _unnamed(level: Level, rng: Generator) -> Level:
    """R6."""
    return replace(level, openings=(), leaves=(), named_openings=False)


def _holes_without_floor(level: Level, rng: Generator) -> Level:
    """R7."""
    return replace(_holes(level, rng), floor=None)


def _with(
    level: Level,
    vertices: np.ndarray[tuple[int, ...], np.dtype[np.float64]] | None = None,
    faces: np.ndarray[tuple[int, ...], np.dtype[np.int64]] | None = None,
) -> Level:
    walls = level.walls
    mesh = Mesh(walls.vertices if vertices is None else vertices, walls.faces if faces is None else faces)
    return replace(level, walls=mesh)
