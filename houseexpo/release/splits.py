"""Assign each plan of a release to a part, by the data set's own lists or to train, val and test; no house is in two.

R1  Lists that come with the data set are used if each plan is in exactly one of them.
R2  If there are none, the plans are split with the default shares and seed of ``houseexpo split``.
R3  Levels and copies of one house must be in the same list (``dataset.splits``); other lists are refused.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from houseexpo.dataset import Dataset
from houseexpo.dataset.splits import inseparable_groups, split_plans
from houseexpo.errors import DatasetError
from houseexpo.words import count_noun

SHARES: Final = {"train": 0.7, "val": 0.1, "test": 0.2}
SEED: Final = 0
_NAME: Final = re.compile(r"[A-Za-z0-9_]{1,40}")
_FIRST: Final = tuple(SHARES)


@dataclass(frozen=True)
class ReleaseSplits:
    """The sorted ids of each part; ``group_of`` maps each id to the first id of its group, which must stay together."""

    lists: Mapping[str, tuple[str, ...]]
    group_of: Mapping[str, str]

    @property
    def groups(self) -> int:
        """The number of groups with more than one plan."""
        return sum(count > 1 for count in Counter(self.group_of.values()).values())


def release_splits(plans: Dataset, workers: int = 1) -> ReleaseSplits:
    """Split a data set for its release; raise DatasetError if its own lists are not a valid split."""
    own = plans.splits
    if not own:  # R2
        found = split_plans(plans, SHARES, SEED, workers)
        lists: Mapping[str, tuple[str, ...]] = {name: ids for name, ids in found.parts.items() if ids}
        groups = found.groups
    else:
        groups = inseparable_groups(plans, workers)
        lists = _check_lists(own, plans)
    group_of = {name: group[0] for group in groups for name in group}
    _check_apart(lists, groups, plans)
    return ReleaseSplits({name: tuple(sorted(lists[name])) for name in sorted(lists, key=_place)}, group_of)


def _place(name: str) -> tuple[int, str]:
    return (_FIRST.index(name) if name in _FIRST else len(_FIRST), name)


def _check_lists(own: Mapping[str, tuple[str, ...]], plans: Dataset) -> dict[str, tuple[str, ...]]:
    """Return the lists with sorted ids; raise DatasetError unless each plan is in exactly one of them (R1)."""
    times = Counter(name for ids in own.values() for name in ids)
    wrong = sorted(name for name in {*times, *plans.ids} if times[name] != 1 or name not in plans)
    odd = sorted(name for name in own if not _NAME.fullmatch(name) or name == "all")
    if odd:
        raise DatasetError(
            f"{plans.path}: expected lists named by letters, digits and '_', not 'all'; found {odd[0]!r}"
        )
    if wrong:
        raise DatasetError(
            f"{plans.path}: expected each plan in one of the lists {', '.join(sorted(own))}, found "
            f"{count_noun(len(wrong), 'id')} otherwise, {wrong[0]!r} in {times[wrong[0]]}; run houseexpo split again, "
            "and take lists of your own out of splits/: a release is divided once"
        )
    return {name: ids for name, ids in own.items() if ids}


def _check_apart(lists: Mapping[str, tuple[str, ...]], groups: tuple[tuple[str, ...], ...], plans: Dataset) -> None:
    """Raise DatasetError if lists divide a group (R3)."""
    part_of = {name: part for part, ids in lists.items() for name in ids}
    for group in groups:
        sides = sorted({part_of[name] for name in group})
        if len(sides) > 1:
            raise DatasetError(
                f"{plans.path}: expected levels and copies of a house in one list, found {', '.join(group[:3])} in "
                f"{' and '.join(sides)}; run houseexpo split again, which keeps them together"
            )
