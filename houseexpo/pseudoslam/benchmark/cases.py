"""Choose the plans, starts and seeds of a benchmark run, the same for everybody, whatever the data set's order.

R1  Plans are taken in the order of their ids' SHA-256, so that a smaller number gives the first plans of a larger one.
R2  A plan is skipped unless a robot of 0.2 m can reach every place where it fits.
R3  A plan is skipped if it repeats a plan of another list or an earlier one: the same walls by 98%, possibly rotated or
    mirrored, as compared by ``houseexpo split``.
R4  For the published test list, both results are recorded in ``data_manifests/benchmark.toml`` and read from there.
    A track of large plans first takes the largest ones by area that R2 and R3 allow; R1 gives their order.
R5  A start is drawn with a seed from the ids of the track and the plan; it depends on nothing else.
R6  The seed of a policy comes from the run's seed and from the first map that the policy sees, so that it tells the
    policy nothing else about the plan.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from houseexpo.analysis.similarity import find_similar_pairs
from houseexpo.dataset import Dataset
from houseexpo.dataset.manifest import manifest_path
from houseexpo.dataset.splits import encode_id_list
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.progress import show_progress
from houseexpo.words import count_noun

RADIUS_M: Final = 0.2


@dataclass(frozen=True)
class Case:
    """An episode: a plan, the seeds of the start and of the policy, and the start's pose (m, m, rad) if it is given."""

    plan_id: str
    seed: int
    pose: tuple[float, float, float] | None = None

    @property
    def options(self) -> dict[str, Any]:
        """The options of the environment's reset."""
        return {"plan_id": self.plan_id, "pose": self.pose}


def make_cases(track_id: str, plan_ids: Sequence[str]) -> list[Case]:
    """Return a case for each plan (R5)."""
    return [Case(name, seed_from_words(track_id, name)) for name in plan_ids]


def make_room_cases(track_id: str, room_id: str, number: int) -> list[Case]:
    """Return a number of cases in one room with different obstacles."""
    return [Case(room_id, seed_from_words(track_id, f"{room_id} {i}")) for i in range(number)]


def seed_from_words(*words: str) -> int:
    """Return a seed of 32 bits, computed from words."""
    return int.from_bytes(hashlib.sha256("\n".join(words).encode()).digest()[:4])


def policy_seed_at_start(run_seed: int, first_map: npt.NDArray[np.uint8]) -> int:
    """Return the seed of a policy in an episode (R6); the map (rows, cols) is the robot's at the start."""
    return seed_from_words(str(run_seed), str(first_map.shape), first_map.tobytes().hex())


def ids_sha256(ids: Sequence[str]) -> str:
    """Return the hash of a list of ids, equal to ``sha256sum`` of a file with one id per line."""
    return hashlib.sha256(encode_id_list(ids)).hexdigest()


def content_sha256(plans: Dataset) -> str:
    """Return the hash of the contents of the plans, in order."""
    found = hashlib.sha256()
    for number in range(len(plans)):
        found.update(plans.digest(number))
    return found.hexdigest()


def choose_plan_ids(
    plans: Dataset, split: str, number: int, workers: int = 1, largest: int = 0, *, fewer: bool = False
) -> list[str]:
    """Return the ids of ``number`` plans of a list that comes with a data set.

    Parameters
    ----------
    largest
        The number of largest suitable plans to draw from; 0, or a number beyond their count, means all of them.
    fewer
        Whether all suitable plans will do if there are fewer than ``number``, but at least one.

    Raises
    ------
    ConfigError
        There are too few suitable plans.
    DatasetError
        The data set has no such list.
    """
    if plans.left_out:
        raise DatasetError(
            f"{plans.path}: expected a whole data set, found {count_noun(len(plans.left_out), 'plan')} that cannot be "
            f"read: {plans.left_out[0]}; get it again, or take them out: the list would be another one"
        )
    if split not in plans.splits:
        known = ", ".join(sorted(plans.splits)) or "none"
        raise DatasetError(
            f"{plans.path}: expected a list {split!r} of plans, found: {known}; lay map_id_{split}.txt beside it, or "
            "divide it with `houseexpo split`"
        )
    if largest and number > largest:
        raise ConfigError(f"--plans {number}: this track has the {largest} largest plans; ask for at most so many")
    written = read_test_ids("large" if largest else "test") if split == "test" else ()
    listed = set(plans.splits[split])
    if len(written) >= number and all(name in plans and name in listed for name in written[:number]):  # R4
        return list(written[:number])
    here = plans.split(split)
    order = sorted(here.ids, key=_hash)  # R1
    if largest:
        area = dict(zip(here.ids, here.column("area"), strict=True))
        order.sort(key=lambda name: -area[name])
    found = sorted(_choose_plans(plans, order, largest or number, workers), key=_hash)[:number]
    if len(found) < number and not (fewer and found):
        raise ConfigError(
            f"--plans {number}: list {split!r} of {plans.path} has {count_noun(len(found), 'plan')} that a robot of "
            f"{RADIUS_M} m can cross and that repeat no other; ask for at most so many"
        )
    return found


def read_test_ids(name: str = "test") -> tuple[str, ...]:
    """Return the plans of the published test list that the benchmark uses, in order (R4), all or the "large" ones."""
    said: dict[str, Any] = tomllib.loads(manifest_path("benchmark").read_text(encoding="utf-8"))
    return tuple(said[name])


def _hash(name: str) -> bytes:
    return hashlib.sha256(name.encode()).digest()


def _choose_plans(plans: Dataset, here: Sequence[str], number: int, workers: int) -> list[str]:
    """Return the first plans of a list, at most ``number``, that R2 and R3 allow."""
    others = sorted({name for listed in plans.splits.values() for name in listed if name in plans} - set(here))
    every = plans.only([*others, *here])
    repeats: defaultdict[int, set[int]] = defaultdict(set)
    for pair in find_similar_pairs(every.__getitem__, len(every), threads=workers, label="comparing plans").pairs:
        repeats[pair.first].add(pair.second)
        repeats[pair.second].add(pair.first)
    taken = set(range(len(others)))
    found: list[str] = []
    for i, name in show_progress(enumerate(here, start=len(others)), "choosing plans", len(here)):
        if len(found) == number:
            break
        if repeats[i].isdisjoint(taken) and plans[name].navigability(RADIUS_M).components == 1:  # R3, R2
            found.append(name)
            taken.add(i)
    return found
