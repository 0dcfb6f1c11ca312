"""Where a wall is better cut than elsewhere: places with some evidence of a door, though not enough to be one.

R1  A doorway that the evidence knows and no passage uses, then a leaf beside no passage, then a lintel that closes
    nothing: in this order, the larger ones first.
R2  The way through is square to what lies in the wall; of a leaf, which may stand open, along it too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.geometry.doorways import box_of
from pipeline.geometry.overlay import polygons_of
from pipeline.geometry.spaces import Passage

WIDTH_M = (0.5, 2.5)
REACH_M = 0.8
BESIDE_M = 0.3


@dataclass(frozen=True, eq=False)
class CutPlace:
    """A line (2, 2) across the place of a door that may be, and what speaks for it, in words."""

    line: npt.NDArray[np.float64]
    why: str


def cut_places(
    doorways: Iterable[Polygon], leaves: Iterable[Polygon], lintels: BaseGeometry, passages: Sequence[Passage]
) -> Iterator[CutPlace]:
    """Yield the places, the likeliest first: doorways, leaves of doors and lintels that no passage uses."""
    ways = shapely.STRtree([p.bridge.strip() for p in passages])
    kinds: list[tuple[str, Iterable[Polygon], bool]] = [
        ("a doorway that nothing else leads through", doorways, False),
        ("the leaf of a door", leaves, True),
        ("a lintel", polygons_of(lintels), False),
    ]
    return chain.from_iterable(_of_kind(why, shapes, ways, leaf) for why, shapes, leaf in kinds)


def _of_kind(why: str, shapes: Iterable[Polygon], ways: shapely.STRtree, leaf: bool) -> Iterator[CutPlace]:
    """R1, R2."""
    for shape in sorted(shapes, key=lambda p: (-p.area, p.bounds)):
        box = box_of(shape)
        if not WIDTH_M[0] <= box.width <= WIDTH_M[1] or len(ways.query(shape, "dwithin", BESIDE_M)):
            continue
        yield CutPlace(_line(box.centre, box.across, REACH_M), why)
        if leaf:
            yield CutPlace(_line(box.centre, box.along, box.width / 2 + REACH_M), why)


def _line(centre: npt.NDArray[np.float64], way: npt.NDArray[np.float64], reach_m: float) -> npt.NDArray[np.float64]:
    return np.stack([centre - reach_m * way, centre + reach_m * way])
