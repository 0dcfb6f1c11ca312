"""List the plans that need a review, with reasons: not connected for a robot, an invalid ring, a repeated plan.

R1  A plan is not connected if a disc of the given radius cannot reach every place where it fits, or fits nowhere.
R2  A ring is invalid if it touches or crosses itself.
R3  A plan repeats an earlier one of the data set if its walls are the same, possibly rotated or mirrored.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from houseexpo.dataset import Dataset
from houseexpo.floorplan import FloorPlan
from houseexpo.processes import count_cores
from houseexpo.words import count_noun
from stats.record import Record


@dataclass(frozen=True)
class BadPlan:
    """A plan and its faults.

    ``pieces`` is the number of connected areas where the robot can stand, None if it can reach all of them;
    ``largest_share`` is the share of the largest one.
    """

    id: str
    pieces: int | None = None
    largest_share: float | None = None
    ring: str | None = None
    repeats: str | None = None

    def reasons(self, radius_m: float) -> Iterator[str]:
        """Yield a description of each fault."""
        robot = f"a robot of {radius_m:.2f} m"
        if self.pieces == 0:
            yield f"{robot} fits nowhere"
        elif self.pieces is not None and self.largest_share is not None:
            pieces = count_noun(self.pieces, "piece")
            yield f"not connected for {robot}: {pieces}, {self.largest_share:.0%} in the largest"
        if self.ring is not None:
            yield f"invalid ring: {self.ring} itself"
        if self.repeats is not None:
            yield f"repeats {self.repeats}"

    def values(self) -> dict[str, Any]:
        """Return the faults as plain values."""
        named = {"pieces": self.pieces, "largest_share": self.largest_share, "ring": self.ring, "repeats": self.repeats}
        return {"id": self.id, **{name: value for name, value in named.items() if value is not None}}


def find_bad_plans(
    data_set: Dataset, measured: Sequence[Record], radius_m: float, workers: int | None = None
) -> list[BadPlan]:
    """Return the plans that need a review, in the data set's order.

    Parameters
    ----------
    data_set, measured
        The plans, and their records from ``stats.measure.measure_plans``.
    radius_m
        The robot's radius, metres. Values that the records lack are measured and cached.
    workers
        Number of processes; by default one for each core.
    """
    first: dict[str, str] = {}
    found = []
    for record, (pieces, share) in zip(measured, _reach(data_set, measured, radius_m, workers), strict=True):
        original = first.setdefault(record.shape, record.id)
        connected = pieces == 1
        found.append(
            BadPlan(
                record.id,
                None if connected else pieces,  # R1
                None if connected else round(share, 4),
                record.fault,  # R2
                None if original == record.id else original,  # R3
            )
        )
    return [bad for bad in found if bad != BadPlan(bad.id)]


def _reach(
    data_set: Dataset, measured: Sequence[Record], radius_m: float, workers: int | None
) -> list[tuple[int, float]]:
    """Return for each plan the number of areas where a robot can stand, and the share of the largest one."""
    key = f"{radius_m:.2f}"
    if float(key) == radius_m and all(key in record.reach for record in measured):
        return [record.reach[key][:2] for record in measured]
    found = data_set.measure_cached(
        f"pieces at {radius_m!r} m, 1", partial(_pieces, radius_m), workers or count_cores()
    )
    return [(int(pieces), float(share)) for pieces, share in found]


def _pieces(radius_m: float, plan: FloorPlan) -> tuple[int, float]:
    reach = plan.navigability(radius_m)
    return reach.components, reach.largest_share
