"""What plans are filtered, sorted and counted by: one table in memory, made once for a data set.

Numbers that a plan lacks are NaN: no range holds them. Labels are a row of bits a label.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.dataset import Dataset
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import RADII_M
from houseexpo.plan.categories import LABELS

Numbers = npt.NDArray[np.float64]
Bits = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Measure:
    """A number of a plan: how it is called in addresses and on pages, its unit, and whether it counts things."""

    name: str
    title: str
    unit: str = ""
    counts: bool = False


MEASURES: Final = (
    Measure("rooms", "Rooms in the source", counts=True),
    Measure("area", "Free area", "m²"),
    Measure("long_side", "Longer side", "m"),
    Measure("short_side", "Shorter side", "m"),
    Measure("doors", "Doors", counts=True),
    Measure("cuts", "Doors that are cuts", counts=True),
    Measure("holes", "Holes", counts=True),
    Measure("vertices", "Vertices", counts=True),
    Measure("quality", "Quality"),
    Measure("narrowest", "Narrowest passage", "m"),
    Measure("reach", "Reached by a robot"),
)
"""``narrowest`` and ``reach`` are those of a robot's radius (``Table.numbers``)."""

OF_A_RADIUS: Final = frozenset({"narrowest", "reach"})
RADII: Final = tuple(f"{radius:.2f}" for radius in RADII_M)
USUAL_RADIUS: Final = "0.20"

_QUICK: Final = "shape of a plan, 2"
"""Under which name ``_shape_of`` is kept; another way of measuring needs another number."""


@dataclass(frozen=True)
class Table:
    """The measures of a data set's plans, in its order.

    Attributes
    ----------
    ids, words
        Of each plan: its id, and what a search looks through, in small letters.
    labels
        (25, n) whether the plan has the label, in the order of ``LABELS``.
    groups
        ``source`` and ``split``: the names that occur, and for each plan which of them (n,), -1 where it has none.
    drawn
        How many rooms each plan records, or 0 if it records an outline and label boxes only.
    """

    ids: Sequence[str]
    words: Sequence[str]
    labels: Bits
    groups: Mapping[str, tuple[tuple[str, ...], npt.NDArray[np.int32]]]
    drawn: Sequence[int]
    _numbers: Mapping[str, Numbers] = field(repr=False)

    def __len__(self) -> int:
        return len(self.ids)

    def numbers(self, measure: str, radius: str = USUAL_RADIUS) -> Numbers:
        """Return a measure of each plan (n,), for a robot's radius ("0.20") where it depends on one."""
        return self._numbers[f"{measure} {radius}" if measure in OF_A_RADIUS else measure]

    def title(self, row: int) -> str:
        """Return what a plan is called on pages: "9 rooms, 121 m²"; its id where neither is known.

        The rooms are those of the plan; of a plan without, those of its source.
        """
        rooms, area = self.drawn[row] or self.value(row, "rooms"), self.value(row, "area")
        words = [] if rooms is None else ["1 room" if rooms == 1 else f"{rooms:,.0f} rooms"]
        if area is not None:
            words.append(f"{area:,.0f} m²" if area >= 10 else f"{area:.1f} m²")
        return ", ".join(words) or self.ids[row]

    def value(self, row: int, measure: str, radius: str = USUAL_RADIUS) -> float | None:
        """Return a measure of one plan, or None if it is not known."""
        found = float(self.numbers(measure, radius)[row])
        return None if np.isnan(found) else found


def measured(data: Dataset) -> Table:
    """Make the table of a data set: from its index, and what takes no long look at each plan.

    Doors and reach of published plans are taken where they were computed before; computing them takes minutes
    (``houseexpo serve --measure``).
    """
    sides = np.stack([_column(data, "width"), _column(data, "height")])
    shape = data.derived(_QUICK, _shape_of)
    labels = data.column("labels")
    numbers = {
        "rooms": _column(data, "room_num"),
        "area": _column(data, "area"),
        "long_side": sides.max(axis=0),
        "short_side": sides.min(axis=0),
        "doors": _column(data, "n_doors"),
        "cuts": _column(data, "n_cuts"),
        "holes": np.array([found[0] for found in shape], dtype=np.float64),
        "vertices": np.array([found[1] for found in shape], dtype=np.float64),
        "quality": _column(data, "quality"),
        **_reach(data.column("navigability", compute=False)),
    }
    sources = data.column("source")
    spelt = (" ".join(each).replace("_", " ") for each in labels)
    words = zip(data.ids, spelt, (source or "" for source in sources), (found[2] for found in shape), strict=True)
    return Table(
        ids=data.ids,
        words=[" ".join(each).casefold() for each in words],
        labels=np.array([[label in has for has in map(frozenset, labels)] for label in LABELS], dtype=bool),
        groups={"source": _coded(sources), "split": _coded(_split_of(data))},
        drawn=[found[3] for found in shape],
        _numbers=numbers,
    )


def _column(data: Dataset, name: str) -> Numbers:
    return np.array(data.column(name, compute=False), dtype=np.float64)  # None becomes NaN


def _shape_of(plan: FloorPlan) -> tuple[int, int, str, int]:
    """Holes, vertices of all rings, the words of the source (file and scene), and rooms."""
    told = plan.provenance or {}
    words = [str(told[key]) for key in ("file", "scene", "name") if told.get(key)]
    return len(plan.holes), len(plan.verts) + sum(len(ring) for ring in plan.holes), " ".join(words), len(plan.rooms)


def _reach(found: Sequence[Mapping[str, Mapping[str, float]] | None]) -> dict[str, Numbers]:
    columns = {}
    for radius in RADII:
        of_radius = [(reach or {}).get(radius) or {} for reach in found]
        columns[f"narrowest {radius}"] = np.array([r.get("narrowest", np.nan) for r in of_radius], dtype=np.float64)
        columns[f"reach {radius}"] = np.array([r.get("largest_share", np.nan) for r in of_radius], dtype=np.float64)
    return columns


def _split_of(data: Dataset) -> list[str | None]:
    """Return the list in which each plan stands; where it stands in several, the longest."""
    of: dict[str, str] = {}
    for name, ids in sorted(data.splits.items(), key=lambda item: len(item[1])):
        of.update(dict.fromkeys(ids, name))
    recorded: list[Any] = data.column("split")
    return [of.get(name) or given for name, given in zip(data.ids, recorded, strict=True)]


def _coded(names: Sequence[str | None]) -> tuple[tuple[str, ...], npt.NDArray[np.int32]]:
    known = tuple(sorted({name for name in names if name}))
    code = {name: number for number, name in enumerate(known)}
    return known, np.array([code.get(name or "", -1) for name in names], dtype=np.int32)
