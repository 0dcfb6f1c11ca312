"""Write a house as strangers would have it: in other units, on another axis, mirrored, without its roof or a wall.

A variation changes a ``VariedHouse``: triangles in metres, z up. ``levels_of`` reads the file of a house as if
its author had made that change, so that the file's format, names and conventions stay what they are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final
from unittest import mock

import numpy as np
import numpy.typing as npt
import trimesh

from pipeline.sources import find, mesh_file
from pipeline.sources.meshes.formats import load_scene
from pipeline.sources.meshes.scene import MeshScene, PartNames
from pipeline.sources.storeys.scale import UNITS
from pipeline.values import Level, Mesh

Floats = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

AROUND_FLOOR_M: Final = 0.3
"""A slab and its finish lie within so much of a floor's height."""
LOW_WALL_M: Final = 1.2
GROUND_M: Final = 120.0
SKY_M: Final = 150.0


@dataclass(frozen=True, eq=False)
class VariedHouse:
    """A house: ``corners`` (m, 3, 3) of its triangles in metres, z up; ``owner`` (m,) the part that each is of.

    ``floors`` are the heights of its floors and ``top`` that of its highest ceiling, in metres. ``path`` is its file,
    which was read with ``up`` as its axis and so many ``metres`` in a unit. ``unit`` is what the file's numbers are
    multiplied with, and ``lies`` says that z is written as y, and y as -z, or the reverse. Corners at one place are one
    where they are ``merged``; else each face has three of its own.
    """

    corners: Floats
    owner: npt.NDArray[np.int32]
    parts: tuple[PartNames, ...]
    floors: tuple[float, ...]
    top: float
    path: Path
    up: str
    metres: float
    unit: float = 1.0
    lies: bool = False
    merged: bool = True

    def of_faces(self, keep: Bools) -> VariedHouse:
        """Return the faces of a mask (m,)."""
        return replace(self, corners=self.corners[keep], owner=self.owner[keep])

    def with_mesh(self, mesh: trimesh.Trimesh, name: str) -> VariedHouse:
        """Return the house with one more part."""
        corners = np.concatenate([self.corners, np.asarray(mesh.triangles)])
        owner = np.concatenate([self.owner, np.full(len(mesh.faces), len(self.parts), np.int32)])
        return replace(self, corners=corners, owner=owner, parts=(*self.parts, PartNames((name,), name)))

    @property
    def low(self) -> Floats:
        """Lowest corner (m, 3) of each face."""
        return self.corners.min(axis=1)

    @property
    def high(self) -> Floats:
        """Highest corner (m, 3) of each face."""
        return self.corners.max(axis=1)

    @property
    def slope(self) -> Floats:
        """How far each face (m,) looks up or down, 0 to 1."""
        cross = np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])
        return np.abs(cross[:, 2]) / np.maximum(np.linalg.norm(cross, axis=1), np.finfo(float).tiny)


Variation = Callable[[VariedHouse], VariedHouse]


def as_it_is(house: VariedHouse) -> VariedHouse:
    """Change nothing."""
    return house


def in_units(factor: float) -> Variation:
    """Multiply the numbers of the file."""
    return lambda house: replace(house, unit=house.unit * factor)


def on_the_other_axis(house: VariedHouse) -> VariedHouse:
    """Write z where the format has y, or the reverse."""
    return replace(house, lies=True)


def cut_at(height: float) -> Variation:
    """Keep what lies below a height over the lowest floor."""
    return lambda house: _below(house, house.floors[0] + height)


def without_roof(house: VariedHouse) -> VariedHouse:
    """Take off all that lies above the top of the walls, with the ceiling."""
    return house.of_faces(house.low[:, 2] < house.top - AROUND_FLOOR_M)


def without_one_side(house: VariedHouse) -> VariedHouse:
    """Take away the outer wall on the side of the largest x."""
    edge = np.quantile(house.high[:, 0], 0.995)
    return house.of_faces(~((house.low[:, 0] > edge - 0.6) & (house.slope < 0.1)))


def without_ground_slab(house: VariedHouse) -> VariedHouse:
    """Take away what is level at the lowest floor, and below."""
    return house.of_faces(~((house.high[:, 2] < house.floors[0] + AROUND_FLOOR_M) & (house.slope > 0.9)))


def on_terrain(house: VariedHouse) -> VariedHouse:
    """Put rolling ground around and under the house."""
    middle = house.corners.reshape(-1, 3).mean(axis=0)
    steps = np.linspace(-GROUND_M / 2, GROUND_M / 2, 41)
    x, y = np.meshgrid(steps, steps)
    away = np.maximum(np.abs(x), np.abs(y))
    z = house.floors[0] - 0.15 + np.maximum(away - 25.0, 0.0) * 0.1 * np.sin(x / 9.0) * np.cos(y / 11.0)
    points = np.column_stack([x.ravel() + middle[0], y.ravel() + middle[1], z.ravel()])
    first = (np.arange(40)[:, None] * 41 + np.arange(40)).ravel()
    faces = np.concatenate(
        [
            np.column_stack([first, first + 1, first + 42]),
            np.column_stack([first, first + 42, first + 41]),
        ]
    )
    return house.with_mesh(trimesh.Trimesh(points, faces, process=False), "Terrain")


def under_a_sky(house: VariedHouse) -> VariedHouse:
    """Put a sphere of the sky around the house."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=SKY_M)
    ball.apply_translation(house.corners.reshape(-1, 3).mean(axis=0))
    ball.invert()
    return house.with_mesh(ball, "Sphere")


def mirrored(house: VariedHouse) -> VariedHouse:
    """Mirror at x = 0, the faces turned over with it."""
    return replace(house, corners=(house.corners * (-1.0, 1.0, 1.0))[:, ::-1])


def turned_by(degrees: float) -> Variation:
    """Turn about the vertical axis."""
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return lambda house: replace(house, corners=house.corners @ turn)


def inside_out(house: VariedHouse) -> VariedHouse:
    """Wind every face the other way."""
    return replace(house, corners=house.corners[:, ::-1])


def in_one_piece(house: VariedHouse) -> VariedHouse:
    """Merge all parts into one, without a name."""
    return replace(house, owner=np.zeros_like(house.owner), parts=(PartNames(),))


def with_each_face_twice(house: VariedHouse) -> VariedHouse:
    """Draw each face from both sides, as exporters of two-sided materials do."""
    corners = np.concatenate([house.corners, house.corners[:, ::-1]])
    return replace(house, corners=corners, owner=np.concatenate([house.owner, house.owner]))


def far_away(house: VariedHouse) -> VariedHouse:
    """Put the house where a surveyor's coordinates are."""
    return replace(house, corners=house.corners + np.array((2_600.0, 1_200.0, 0.0)))


def moved(house: VariedHouse) -> VariedHouse:
    """Move by less than any grid's cell."""
    return replace(house, corners=house.corners + np.array((0.37, 0.37, 0.0)))


def rounded(house: VariedHouse) -> VariedHouse:
    """Round to single precision, 100 m from the origin."""
    corners = house.corners + np.array((100.0, 100.0, 0.0))
    return replace(house, corners=corners.astype(np.float32).astype(np.float64))


def in_another_order(house: VariedHouse) -> VariedHouse:
    """Shuffle the faces, and begin each at any of its corners."""
    rng = np.random.default_rng(7)
    order = rng.permutation(len(house.corners))
    first = rng.integers(0, 3, len(order))
    corners = np.take_along_axis(house.corners[order], ((first[:, None] + np.arange(3)) % 3)[:, :, None], axis=1)
    return replace(house, corners=corners, owner=house.owner[order])


def unmerged(house: VariedHouse) -> VariedHouse:
    """Write each corner once for each face that has it."""
    return replace(house, merged=False)


def one_part_a_face(house: VariedHouse) -> VariedHouse:
    """Make a part of each face; its names stay."""
    owner = np.arange(len(house.owner), dtype=np.int32)
    return replace(house, owner=owner, parts=tuple(house.parts[k] for k in house.owner))


def with_other_diagonals(house: VariedHouse) -> VariedHouse:
    """Divide level and upright parallelograms and trapezia along their other diagonal, where two faces make one."""
    places = np.unique(np.round(house.corners.reshape(-1, 3), 6), axis=0, return_inverse=True)[1].reshape(-1, 3)
    cross = np.cross(house.corners[:, 1] - house.corners[:, 0], house.corners[:, 2] - house.corners[:, 0])
    double = np.linalg.norm(cross, axis=1)
    unit = cross / np.maximum(double, np.finfo(float).tiny)[:, None]
    owner = house.owner.tolist()
    sides: dict[tuple[int, int, int], list[tuple[int, int]]] = {}
    for face, ring in enumerate(places.tolist()):
        for k in range(3):
            sides.setdefault((owner[face], ring[k], ring[(k + 1) % 3]), []).append((face, k))
    corners = house.corners.copy()
    free = double > 1e-9
    for (part, start, end), own in sides.items():
        across = sides.get((part, end, start), [])
        if len(own) != 1 or len(across) != 1:
            continue
        (one, k), (other, j) = own[0], across[0]
        if not (free[one] and free[other]) or unit[one] @ unit[other] < 1 - 1e-9:
            continue
        a, b, c = house.corners[one][[k, (k + 1) % 3, (k + 2) % 3]]
        d = house.corners[other][(j + 2) % 3]
        if min(np.cross(a - c, d - c) @ unit[one], np.cross(d - c, b - c) @ unit[one]) < 1e-6 * double[one]:
            continue
        corners[one], corners[other] = (c, a, d), (c, d, b)
        free[[one, other]] = False
    return replace(house, corners=corners)


def finely_divided(house: VariedHouse) -> VariedHouse:
    """Divide each face into four."""
    a, b, c = house.corners.transpose(1, 0, 2)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    corners = np.concatenate([np.stack(part, axis=1) for part in parts])
    return replace(house, corners=corners, owner=np.tile(house.owner, 4))


UNSEEN: Final[Mapping[str, Variation]] = {
    "as it is": as_it_is,
    "faces in another order": in_another_order,
    "corners not merged": unmerged,
    "other diagonals": with_other_diagonals,
    "each face divided": finely_divided,
    "each face twice": with_each_face_twice,
    "each face inside out": inside_out,
    "one piece without names": in_one_piece,
    "one part a face": one_part_a_face,
    "moved by 0.37 m": moved,
    "single precision at 100 m": rounded,
    "far from the origin": far_away,
    "mirrored": mirrored,
    "turned by 7 degrees": turned_by(7.0),
    "turned by 33 degrees": turned_by(33.0),
}
"""What nobody sees in a viewer, by a name."""

VARIATIONS: Final[Mapping[str, Variation]] = {
    **UNSEEN,
    "numbers in feet": in_units(1 / 0.3048),
    "numbers times 0.3048": in_units(0.3048),
    "numbers in inches": in_units(1 / 0.0254),
    "numbers in centimetres": in_units(100.0),
    "numbers times 0.01": in_units(0.01),
    "on the other axis": on_the_other_axis,
    "without roof": without_roof,
    "without ground slab": without_ground_slab,
    "on terrain": on_terrain,
    "under a sky": under_a_sky,
    "without one outer wall": without_one_side,
    "walls cut at 1.2 m": cut_at(LOW_WALL_M),
}
"""What is changed, by a name. All but the last two leave rooms and doors as they are."""


def house_of(path: Path) -> VariedHouse:
    """Load a mesh file as a house; raises Rejection where it has no level."""
    (item,) = find(str(path))
    levels = list(mesh_file.read(item))
    units = str(levels[0].provenance["units"])
    metres = UNITS[units] if units in UNITS else float(units.removesuffix(" m"))
    raw = load_scene(path)
    corners = raw.mesh.vertices[raw.mesh.faces] * metres
    up = str(levels[0].provenance["up"])
    if up == "y":
        corners = np.stack([corners[..., 0], -corners[..., 2], corners[..., 1]], axis=-1)
    floors = tuple(level.frame.floor for level in levels if level.frame is not None)
    return VariedHouse(corners, raw.owner, raw.parts, floors, floors[-1] + levels[-1].ceiling_m, path, up, metres)


def levels_of(house: VariedHouse) -> Iterator[Level]:
    """Read a house's file as if its triangles were these; raises Rejection where it gives no level."""
    corners = house.corners * (house.unit / house.metres)
    if (house.up == "y") != house.lies:
        corners = np.stack([corners[..., 0], corners[..., 2], -corners[..., 1]], axis=-1)
    vertices, faces = corners.reshape(-1, 3), np.arange(corners.size // 3)
    if house.merged:
        vertices, faces = np.unique(vertices, axis=0, return_inverse=True)
    scene = MeshScene(Mesh(vertices, faces.reshape(-1, 3).astype(np.int64)), house.owner, house.parts)
    (item,) = find(str(house.path))
    with mock.patch.object(mesh_file, "load_scene", return_value=scene):
        yield from mesh_file.read(item)


def _below(house: VariedHouse, height: float) -> VariedHouse:
    """Cut the triangles at a height, and keep what lies below."""
    whole = house.high[:, 2] <= height
    cut = np.flatnonzero(~whole & (house.low[:, 2] < height))
    corners = house.corners[cut]
    order = np.argsort(corners[:, :, 2], axis=1)
    low, middle, high = np.take_along_axis(corners, order[:, :, None], axis=1).transpose(1, 0, 2)
    turned_over = ((order[:, 1] - order[:, 0]) % 3 == 2)[:, None, None]

    def at_height(one: Floats, other: Floats) -> Floats:
        share = (height - one[:, 2]) / np.where(other[:, 2] == one[:, 2], 1.0, other[:, 2] - one[:, 2])
        return one + (other - one) * share[:, None]

    edge = at_height(low, high)
    tip = middle[:, 2] >= height
    first = np.where(tip[:, None], at_height(low, middle), middle)
    beside = at_height(middle, high)
    parts = [
        np.stack([low, first, np.where(tip[:, None], edge, beside)], axis=1),
        np.stack([low, beside, edge], axis=1),
    ]
    parts = [np.where(turned_over, part[:, ::-1], part) for part in parts]
    return replace(
        house,
        corners=np.concatenate([house.corners[whole], parts[0], parts[1][~tip]]),
        owner=np.concatenate([house.owner[whole], house.owner[cut], house.owner[cut][~tip]]),
    )
