"""Tell which plans are copies: plans with the same walls, openings, rooms, doors and furniture.

Two plans are copies if one of them, turned by a multiple of 90 degrees or mirrored and laid on the other by the middle
of its bounds, satisfies all of these:

R1  *Walls*: every point of the walls of either plan lies within ``SAME_WALL_M`` of a wall of the other plan. So a
    partition counts as much as an outer wall, however thin it is.
R2  *Openings*: each door has a partner whose middle is within ``SAME_WALL_M`` and whose width differs by at most
    ``OPENING_M``. Entrances are doors. In a plan without rooms and doors, such as a published plan, the narrow places
    of the free space stand for doors.
R3  *Rooms*: each room has a partner whose bounds are within ``SAME_WALL_M``, and no two partners have different labels.
    Published plans have no outlines of rooms; their boxes and labels are not compared.
R4  *Furniture*: each object has a partner of the same name whose bounds are within ``SAME_WALL_M``.
R5  *Area*: the pixel difference (``analysis.similarity``) is at most the threshold.

R5 is the paper's rule. By itself, it takes a hall for a copy of a flat, since thin walls have hardly any area.
``docs/algorithm.md`` has the results of these rules among the published plans.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from houseexpo.analysis.similarity import (
    KEPT_MASKS,
    PIXELS_PER_METRE,
    SHIFT_PX,
    SYMMETRIES,
    THRESHOLD,
    Load,
    PairSearchResult,
    SimilarPair,
    crop_mask,
    find_similar_pairs,
    space_with_furniture,
)
from houseexpo.errors import ConfigError, PlanError
from houseexpo.grids.raster import Mask, all_rings
from houseexpo.plan.model import PlanData
from houseexpo.plan.room_labels import UNLABELLED

if TYPE_CHECKING:
    from houseexpo.analysis.navigability import Passages

Floats = npt.NDArray[np.float64]

SAME_WALL_M: Final = 0.1
"""The most distance between the same wall in two exporters' files, metres: a hand's breadth."""
OPENING_M: Final = 0.03
"""The most difference of the same door's widths, metres: both jambs are rounded to centimetres."""

_STEP_M: Final = 0.05  # between points of a wall: half of ``SAME_WALL_M``, so that no gap lies between two points
_WIDEST_M: Final = 1.5  # wider places of a free space without doors are not compared


class Duplicate(NamedTuple):
    """A plan that is a duplicate of a kept plan; ``symmetry`` maps it onto the kept plan."""

    id: str
    kept_id: str
    difference: float
    symmetry: str


class _Parts(NamedTuple):
    """Rooms, doors or objects: ``boxes`` (n, 4) by two corners, ``names``, and ``widths`` (n,) of doors, metres."""

    boxes: Floats
    names: tuple[str, ...]
    widths: Floats


@dataclass(frozen=True)
class WallsAndParts:
    """The compared contents of a plan, in metres from the middle of its bounds; ``size`` is the size of the bounds."""

    plan: PlanData | None
    edges: Floats
    middle: Floats
    size: tuple[float, float]
    rooms: _Parts
    doors: _Parts
    objects: _Parts

    @cached_property
    def passages(self) -> Passages:
        """The narrow places of the free space."""
        from houseexpo.analysis.navigability import Passages, find_passages

        if self.plan is None:
            return Passages(np.zeros(0), np.zeros((0, 2)))
        found = find_passages(self.plan.free_space, _WIDEST_M)
        return Passages(found.radius, found.middle - self.middle)


def find_duplicates(
    shapes: Mapping[str, Mask] | Iterable[PlanData],
    threshold: float = THRESHOLD,
    pixels_per_metre: float = PIXELS_PER_METRE,
    *,
    threads: int = 1,
) -> list[Duplicate]:
    """Find plans that are the same house, up to rotations by 90 degrees and mirroring.

    Plans are taken in the order of their ids. A plan that is a copy of a kept one (R1 to R5) is a duplicate of the
    first such plan; otherwise it is kept. The first call compiles the comparison, which takes some seconds.

    Parameters
    ----------
    shapes
        Plans, or masks by id. The plans of a ``Dataset`` are read one at a time.
    threshold
        Largest difference of duplicates, as a share of the larger plan's area (0 to 1).
    pixels_per_metre
        Resolution of the masks, and of the comparison of areas.
    threads
        Number of threads; the result does not depend on it.

    Returns
    -------
    Duplicates, sorted by id.

    Raises
    ------
    PlanError
        Two plans have the same id.
    ConfigError
        The threshold is not between 0 and 1, or there is no thread.
    """
    if not 0 <= threshold <= 1:
        raise ConfigError(f"threshold: expected a share of 0 to 1, found {threshold!r}")
    if threads < 1:
        raise ConfigError(f"threads: expected 1 or more, found {threads!r}")
    ids, load = _ids_and_load(shapes)
    order = sorted(range(len(ids)), key=ids.__getitem__)
    names = [ids[i] for i in order]
    if twice := [name for name, following in pairwise(names) if name == following]:
        raise PlanError("expected ids that differ, found this one twice", "id", twice[0])
    found = find_copies(
        lambda i: load(order[i]), len(order), threshold=threshold, pixels_per_metre=pixels_per_metre, threads=threads
    )
    return choose_duplicates(names, found.pairs)


def find_copies(
    load: Load,
    count: int,
    *,
    threshold: float = THRESHOLD,
    pixels_per_metre: float = PIXELS_PER_METRE,
    symmetries: bool = True,
    shift_px: int = SHIFT_PX,
    known: PairSearchResult | None = None,
    threads: int = 1,
) -> PairSearchResult:
    """Find all pairs of plans that are copies (R1 to R5). ``find_similar_pairs`` has the same parameters."""

    @lru_cache(maxsize=KEPT_MASKS)
    def walls(number: int) -> WallsAndParts:
        return walls_and_parts(load(number), pixels_per_metre)

    def confirm(pair: tuple[int, int]) -> str | None:
        return copy_symmetry(walls(pair[0]), walls(pair[1]), symmetries=symmetries)

    return find_similar_pairs(
        load,
        count,
        threshold=threshold,
        pixels_per_metre=pixels_per_metre,
        symmetries=symmetries,
        shift_px=shift_px,
        known=known,
        threads=threads,
        confirm=confirm,
    )


def choose_duplicates(
    ids: Sequence[str], pairs: Collection[SimilarPair], keep: Collection[str] = ()
) -> list[Duplicate]:
    """Return the plans to drop, sorted by id.

    1. In the order of ids, a plan is kept unless it is a copy of a kept plan; the duplicate names the first such plan.
    2. A plan in ``keep`` is never dropped.

    Parameters
    ----------
    ids
        The ids of the plans, sorted; ``pairs``, which are copies, refer to their positions.
    """
    partners: dict[int, list[SimilarPair]] = {}
    for pair in sorted(pairs):
        partners.setdefault(pair.second, []).append(pair)
    dropped: dict[int, Duplicate] = {}
    for i, name in enumerate(ids):
        kept = next((pair for pair in partners.get(i, []) if pair.first not in dropped), None)
        if kept is not None and name not in keep:
            dropped[i] = Duplicate(name, ids[kept.first], round(kept.difference, 6), kept.symmetry)
    return list(dropped.values())


def walls_and_parts(shape: PlanData | Mask, pixels_per_metre: float = PIXELS_PER_METRE) -> WallsAndParts:
    """Return the compared contents of a plan; for a mask, the sides between free and other cells."""
    if not isinstance(shape, PlanData):
        edges = _mask_edges(crop_mask(shape)) / pixels_per_metre
        middle, size = _middle_and_size(edges)
        empty = _parts([], [], middle)
        return WallsAndParts(None, edges - np.tile(middle, 2), middle, size, empty, empty, empty)
    rings = all_rings(space_with_furniture(shape))
    edges = np.concatenate([np.column_stack([ring, np.roll(ring, -1, axis=0)]) for ring in rings])
    middle, size = _middle_and_size(edges)
    doors = [np.array(door.segment) for door in shape.doors]
    return WallsAndParts(
        shape,
        np.ascontiguousarray(edges - np.tile(middle, 2)),
        middle,
        size,
        _parts([room.ring for room in shape.rooms], [room.label for room in shape.rooms], middle),
        _parts([ends.mean(axis=0, keepdims=True) for ends in doors], [""] * len(doors), middle)._replace(
            widths=np.array([door.width for door in shape.doors])
        ),
        _parts([thing.ring for thing in shape.objects], [thing.label for thing in shape.objects], middle),
    )


def copy_symmetry(one: WallsAndParts, other: WallsAndParts, *, symmetries: bool = True) -> str | None:
    """Return the first symmetry under which the second plan is a copy of the first (R1 to R4), or None."""
    for name in SYMMETRIES if symmetries else ("identity",):
        width, height = other.size[::-1] if SYMMETRIES[name][0] else other.size
        may_be = abs(one.size[0] - width) <= 2 * SAME_WALL_M and abs(one.size[1] - height) <= 2 * SAME_WALL_M
        if may_be and _are_copies(one, other, name):
            return name
    return None


def _are_copies(one: WallsAndParts, other: WallsAndParts, symmetry: str) -> bool:
    from houseexpo.analysis.kernels.walls import all_near

    edges = _apply_symmetry(other.edges, symmetry)

    def within(limit: float) -> bool:
        return all_near(one.edges, edges, limit, _STEP_M) and all_near(edges, one.edges, limit, _STEP_M)

    same_widths = within(OPENING_M / 2)  # no wall moved further, so that no width changed by more than OPENING_M
    if not same_widths and not within(SAME_WALL_M):  # R1
        return False
    if not _match(one.objects, other.objects, symmetry):  # R4
        return False
    if one.rooms.names and other.rooms.names:
        return _match(one.rooms, other.rooms, symmetry) and _match(one.doors, other.doors, symmetry)  # R3, R2
    return same_widths or _openings_match(one, other, edges, symmetry)  # R2


def _match(parts: _Parts, others: _Parts, symmetry: str) -> bool:
    """Return whether each part has a partner with the same place, the same width and a compatible name."""
    if len(parts.names) != len(others.names):
        return False
    if not parts.names:
        return True
    boxes = _apply_symmetry(others.boxes, symmetry)
    low, high = np.minimum(boxes[:, :2], boxes[:, 2:]), np.maximum(boxes[:, :2], boxes[:, 2:])
    apart = np.abs(parts.boxes[:, None] - np.column_stack([low, high])[None]).max(axis=2)
    alike = (apart <= SAME_WALL_M) & (np.abs(parts.widths[:, None] - others.widths[None]) <= OPENING_M)
    named = np.array([[a == b or UNLABELLED in {a, b} for b in others.names] for a in parts.names])
    alike &= named
    return bool(alike.any(axis=0).all() and alike.any(axis=1).all())


def _openings_match(one: WallsAndParts, other: WallsAndParts, edges: Floats, symmetry: str) -> bool:
    """Return whether each narrow place of either plan is equally wide in the other plan."""
    from houseexpo.analysis.navigability import Passages

    here, there = one.passages, other.passages
    there = Passages(there.radius, _apply_symmetry(there.middle, symmetry))
    return _openings_recur(here, there, edges) and _openings_recur(there, here, one.edges)


def _openings_recur(passages: Passages, others: Passages, edges: Floats) -> bool:
    """Return whether each passage is among the others, or the other plan's ``edges`` leave the same width there.

    The second case occurs if a corner as small as a wall's noise makes a passage in only one plan.
    """
    from houseexpo.analysis.kernels.walls import distances

    apart = np.abs(passages.middle[:, None] - others.middle[None]).max(axis=2, initial=0.0)
    wider = np.abs(passages.radius[:, None] - others.radius[None])
    recurs = ((apart <= SAME_WALL_M) & (2 * wider <= OPENING_M)).any(axis=1)
    recurs |= 2 * np.abs(distances(np.ascontiguousarray(passages.middle), edges) - passages.radius) <= OPENING_M
    return bool(recurs.all())


def _apply_symmetry(points: Floats, symmetry: str) -> Floats:
    """Return points (n, 2), or pairs of points (n, 4), about the middle, under one of ``SYMMETRIES``."""
    swap, flip_y, flip_x = SYMMETRIES[symmetry]
    pairs = points.reshape(len(points), points.shape[1] // 2, 2)
    pairs = (pairs[..., ::-1] if swap else pairs) * (-1.0 if flip_x else 1.0, -1.0 if flip_y else 1.0)
    return np.ascontiguousarray(pairs.reshape(points.shape))


def _parts(rings: Sequence[Floats], names: Sequence[str], middle: Floats) -> _Parts:
    boxes = [np.concatenate([ring.min(axis=0) - middle, ring.max(axis=0) - middle]) for ring in rings]
    return _Parts(np.array(boxes).reshape(-1, 4), tuple(names), np.zeros(len(boxes)))


def _middle_and_size(edges: Floats) -> tuple[Floats, tuple[float, float]]:
    ends = edges.reshape(-1, 2)
    if not len(ends):
        return np.zeros(2), (0.0, 0.0)
    low, high = ends.min(axis=0), ends.max(axis=0)
    width, height = (high - low).tolist()
    return (low + high) / 2, (width, height)


def _mask_edges(mask: Mask) -> Floats:
    """Return the sides of cells (n, 4) between free cells and others, in cells."""
    padded = np.pad(mask, 1)
    y, x = np.nonzero(padded[1:, 1:-1] != padded[:-1, 1:-1])
    across = np.column_stack([x, y, x + 1, y])
    y, x = np.nonzero(padded[1:-1, 1:] != padded[1:-1, :-1])
    return np.concatenate([across, np.column_stack([x, y, x, y + 1])]).astype(np.float64)


def _ids_and_load(shapes: Mapping[str, Mask] | Iterable[PlanData]) -> tuple[list[str], Load]:
    """Return the ids of plans or masks, and a function that returns one by its position."""
    if isinstance(shapes, Mapping):
        masks = list(shapes.values())
        return list(shapes), lambda i: crop_mask(masks[i])
    plans = shapes if isinstance(shapes, Sequence) else list(shapes)
    ids = getattr(plans, "ids", None)  # a Dataset knows them without reading its plans
    return list(ids) if ids is not None else [plan.id for plan in plans], plans.__getitem__
