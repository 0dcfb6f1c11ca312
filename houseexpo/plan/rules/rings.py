"""Rules about rings: their grid, their direction, their edges, and whether they are simple."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from houseexpo.plan.area import signed_area
from houseexpo.plan.model import PlanData
from houseexpo.plan.parts import Ring

Broken = tuple[str, str]
"""A violation: the key, and what was expected and found."""

CORNER: Final = (0.1, 0.1)
_EPS: Final = 1e-6


def rings(plan: PlanData) -> Iterator[tuple[str, Ring, bool]]:
    """Yield every ring of a plan: its key, its vertices, and whether it runs clockwise (holes do not)."""
    yield "verts", plan.verts, True
    yield from ((f"holes[{i}]", hole, False) for i, hole in enumerate(plan.holes))


def grid(plan: PlanData) -> Iterator[Broken]:
    """Coordinates of every ring lie on the 1 cm grid."""
    parts = [(f"rooms[{i}].polygon", room.ring) for i, room in enumerate(plan.rooms)]
    parts += [(f"rooms[{i}].holes[{k}]", h) for i, room in enumerate(plan.rooms) for k, h in enumerate(room.holes)]
    parts += [(f"doors[{i}].polygon", door.ring) for i, door in enumerate(plan.doors)]
    parts += [(f"objects[{i}].polygon", thing.ring) for i, thing in enumerate(plan.objects)]
    for key, ring in [*((key, ring) for key, ring, _ in rings(plan)), *parts]:
        cells = ring * 100
        off = np.abs(cells - np.round(cells)).max(axis=1) > _EPS
        if off.any():
            row = int(off.argmax())
            yield f"{key}[{row}]", f"expected whole centimetres, found {ring[row].tolist()}"


def origin(plan: PlanData) -> Iterator[Broken]:
    """``min(verts)`` is (0.1, 0.1)."""
    low = plan.bbox[:2]
    if max(abs(low[0] - CORNER[0]), abs(low[1] - CORNER[1])) > _EPS:
        yield "verts", f"expected the least x and y to be {CORNER}, found {low}"


def direction(plan: PlanData) -> Iterator[Broken]:
    """``verts`` runs clockwise, holes counter-clockwise (x right, y up)."""
    for key, ring, clockwise in rings(plan):
        area = signed_area(ring)
        if (area < 0) is not clockwise:
            yield (
                key,
                f"expected {'clockwise' if clockwise else 'counter-clockwise'}, found a signed area of {area:.2f}",
            )


def directions(plan: PlanData) -> Iterator[Broken]:
    """Edges of a published ring are axis-parallel or at 45 degrees."""
    across, up = np.abs(_edges(plan.verts)).T
    odd = (across > _EPS) & (up > _EPS) & (np.abs(across - up) > _EPS)
    if odd.any():
        row = int(odd.argmax())
        yield f"verts[{row}]", f"expected edges along an axis or at 45 degrees, found ({across[row]:g}, {up[row]:g})"


def repeated(plan: PlanData) -> Iterator[Broken]:
    """No vertex is repeated by the next one."""
    for key, ring, _ in rings(plan):
        same = (np.abs(_edges(ring)) < _EPS).all(axis=1)
        if same.any():
            yield f"{key}[{int(same.argmax())}]", "expected vertices that differ from the next, found the same twice"


def collinear(plan: PlanData) -> Iterator[Broken]:
    """No vertex of a plan of ours lies on the line between its neighbours."""
    for key, ring, _ in rings(plan):
        after = _edges(ring)
        before = np.roll(after, 1, axis=0)
        straight = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) < _EPS
        if straight.any():
            yield f"{key}[{int(straight.argmax())}]", "expected a corner, found a vertex between two others in line"


def _edges(ring: Ring) -> Ring:
    edges: Ring = np.roll(ring, -1, axis=0) - ring
    return edges
