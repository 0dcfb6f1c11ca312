"""Plans that need a look: what a robot cannot cross, rings that are no polygons, repeats.

R1  A plan is not connected where a disc of the radius cannot get to all places that it fits into, or fits nowhere.
R2  A ring is invalid where it touches or crosses itself.
R3  A plan repeats an earlier one of the data set where its walls lie on that one's, turned or mirrored perhaps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from houseexpo.dataset import Dataset
from houseexpo.floorplan import FloorPlan
from houseexpo.words import counted
from houseexpo.workers import cores
from stats.record import Record


@dataclass(frozen=True)
class Bad:
    """A plan and what is wrong with it; ``pieces`` is None where a robot gets everywhere.

    ``pieces`` counts the connected pieces of where a robot can stand, ``largest_share`` is the largest one's share.
    """

    id: str
    pieces: int | None = None
    largest_share: float | None = None
    ring: str | None = None
    repeats: str | None = None

    def reasons(self, radius_m: float) -> Iterator[str]:
        """Yield what is wrong, in words."""
        robot = f"a robot of {radius_m:.2f} m"
        if self.pieces == 0:
            yield f"{robot} fits nowhere"
        elif self.pieces is not None and self.largest_share is not None:
            yield f"not connected for {robot}: {counted(self.pieces, 'piece')}, {self.largest_share:.0%} in the largest"
        if self.ring is not None:
            yield f"invalid ring: {self.ring} itself"
        if self.repeats is not None:
            yield f"repeats {self.repeats}"

    def values(self) -> dict[str, Any]:
        """Return plain values; what is sound is left out."""
        named = {"pieces": self.pieces, "largest_share": self.largest_share, "ring": self.ring, "repeats": self.repeats}
        return {"id": self.id, **{name: value for name, value in named.items() if value is not None}}


def find_bad(data_set: Dataset, measured: Sequence[Record], radius_m: float, workers: int | None = None) -> list[Bad]:
    """Return the plans that need a look, in the data set's order.

    Parameters
    ----------
    data_set, measured
        The plans, and ``stats.gather.records`` of them.
    radius_m
        Of the robot; what the records do not hold is measured, and kept as they are.
    workers
        Processes; one a core by default.
    """
    first: dict[str, str] = {}
    found = []
    for record, (pieces, share) in zip(measured, _reach(data_set, measured, radius_m, workers), strict=True):
        original = first.setdefault(record.shape, record.id)
        connected = pieces == 1
        found.append(
            Bad(
                record.id,
                None if connected else pieces,  # R1
                None if connected else round(share, 4),
                record.fault,  # R2
                None if original == record.id else original,  # R3
            )
        )
    return [bad for bad in found if bad != Bad(bad.id)]


def _reach(
    data_set: Dataset, measured: Sequence[Record], radius_m: float, workers: int | None
) -> list[tuple[int, float]]:
    """Return, for each plan, the pieces in which a robot can stand and the largest one's share."""
    key = f"{radius_m:.2f}"
    if float(key) == radius_m and all(key in record.reach for record in measured):
        return [record.reach[key][:2] for record in measured]
    found = data_set.derived(f"pieces at {radius_m!r} m, 1", partial(_pieces, radius_m), workers or cores())
    return [(int(pieces), float(share)) for pieces, share in found]


def _pieces(radius_m: float, plan: FloorPlan) -> tuple[int, float]:
    reach = plan.navigability(radius_m)
    return reach.components, reach.largest_share
