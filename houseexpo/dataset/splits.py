"""Split a data set for learning, so that no house and no copy of a house is in two parts.

R1  *Buildings*: levels of one house stay together (ids that differ only in ``_L<n>``, or the same input file).
R2  *Copies and variants*: plans whose pixel difference is at most 0.02 under the eight symmetries
    (``analysis.similarity``) stay together: copies, and the same house with other partitions, doors or furniture. This
    is transitive.
R3  *Strata*: plans are grouped by the rooms that their source counts and by area; each part gets its share of each.
R4  The seed makes the choice; the same seed always splits a data set in the same way.
"""

from __future__ import annotations

import hashlib
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from houseexpo.analysis.similarity import THRESHOLD, find_similar_pairs
from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.files import encode_json, make_folder, read_json, sha256_of, write_atomically
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.ids import parts_of

PAPER: Final = {"train": 0.7, "test": 0.3}
"""The paper's shares."""

ROOMS: Final = (2, 4, 6, 8, 10, 15)
"""The numbers of rooms at which a new stratum starts; each is divided into four quarters by area."""


@dataclass(frozen=True)
class Split:
    """A split: the sorted ids of each part, and its parameters; ``groups`` are the ids that had to stay together."""

    parts: Mapping[str, tuple[str, ...]]
    seed: int
    shares: Mapping[str, float]
    groups: tuple[tuple[str, ...], ...]

    def record(self) -> dict[str, Any]:
        """Return the contents of ``splits.json``: parameters, and the count and SHA-256 of each list."""
        return {
            "seed": self.seed,
            "shares": dict(self.shares),
            "threshold": THRESHOLD,
            "groups": sum(len(group) > 1 for group in self.groups),
            "lists": {
                name: {"ids": len(ids), "sha256": hashlib.sha256(encode_id_list(ids)).hexdigest()}
                for name, ids in self.parts.items()
            },
        }


def split_plans(plans: Dataset, shares: Mapping[str, float], seed: int, workers: int = 1) -> Split:
    """Split the plans into named parts.

    Parameters
    ----------
    shares
        The share of each part, by name. They must add up to 1; a part with share 0 is left out.
    workers
        Number of threads.

    Raises
    ------
    ConfigError
        A share is not from 0 to 1, or they do not add up to 1.
    """
    _check(shares)
    used = {name: share for name, share in shares.items() if share > 0}
    groups = inseparable_groups(plans, workers)
    index = {name: number for number, name in enumerate(plans.ids)}
    strata = _strata(plans)
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(groups)).tolist()
    # R3: by the stratum of the first plan; within it large groups first, as the hardest to place, then at random
    order.sort(key=lambda g: (strata[index[groups[g][0]]], -len(groups[g])))
    parts: dict[str, list[str]] = {name: [] for name in used}
    placed = 0
    for g in order:
        placed += len(groups[g])
        lacking = {name: share * placed - len(parts[name]) for name, share in used.items()}
        parts[max(lacking, key=lambda name: lacking[name])].extend(groups[g])
    return Split({name: tuple(sorted(ids)) for name, ids in parts.items()}, seed, used, groups)


def inseparable_groups(plans: Dataset, workers: int = 1) -> tuple[tuple[str, ...], ...]:
    """Return the ids in groups that no split may divide (R1, R2), each sorted, the groups by their first id."""
    ids = plans.ids
    sets = _Sets(len(ids))
    first: dict[str, int] = {}

    def load(i: int) -> FloorPlan:
        plan = plans[i]
        if file := str((plan.provenance or {}).get("sha256", "")):
            sets.join(first.setdefault(f"file {file}", i), i)  # R1
        return plan

    for i, name in enumerate(ids):  # R1
        sets.join(first.setdefault("id " + parts_of(name).of_building, i), i)
    for pair in find_similar_pairs(load, len(ids), threads=workers, label="looking for copies").pairs:  # R2
        sets.join(pair.first, pair.second)
    return tuple(sorted(tuple(sorted(ids[i] for i in group)) for group in sets.groups()))


def encode_id_list(ids: Iterable[str]) -> bytes:
    """Return the bytes of a list's file: one id per line."""
    return "".join(f"{name}\n" for name in ids).encode()


def write_split(found: Split, folder: Path, *, replace: bool = False) -> list[Path]:
    """Write ``splits/<name>.txt`` and, last, ``splits/splits.json`` into a folder.

    In a data set folder, also update the index's column ``split`` and the manifest's hashes. The lists of a former
    split are removed. Other lists stay; one of the same name is overwritten only with ``replace``.

    Raises
    ------
    ConfigError
        A list of the same name is there that no split wrote, or that was changed since.
    """
    home = folder / "splits"
    lists = {home / f"{name}.txt": encode_id_list(ids) for name, ids in found.parts.items()}
    former = {file for file, unchanged in find_split_lists(home).items() if unchanged}
    if not replace:
        for file, data in lists.items():
            if file.exists() and file not in former and file.read_bytes() != data:
                raise ConfigError(
                    f"{file}: a list is there already that no split wrote, or that was changed since; --replace "
                    "writes over it, or choose another --out"
                )
    make_folder(home)
    for old in former - lists.keys():
        old.unlink()
    for file, data in lists.items():
        write_atomically(file, data)
    written = [*lists, home / "splits.json"]
    write_atomically(written[-1], encode_json(found.record()))
    if (folder / "index.parquet").exists():
        _into_index(found, folder / "index.parquet")
    if (folder / "manifest.json").exists():
        _into_manifest(folder, [*written, folder / "index.parquet"])
    return written


def find_split_lists(home: Path) -> dict[Path, bool]:
    """Return the lists in a folder ``splits`` that ``splits.json`` names, and whether each is as the split wrote it.

    Other lists are somebody's own.
    """
    try:
        said = read_json(home / "splits.json", _Former).lists
        return {file: sha256_of(file) == said[file.stem].sha256 for file in home.glob("*.txt") if file.stem in said}
    except (OSError, msgspec.DecodeError):
        return {}


class _FormerList(msgspec.Struct):
    sha256: str


class _Former(msgspec.Struct):
    lists: dict[str, _FormerList]


class _Sets:
    """Disjoint sets of numbers that can be merged."""

    def __init__(self, count: int) -> None:
        self._parent = list(range(count))

    def root(self, i: int) -> int:
        while self._parent[i] != i:
            self._parent[i] = self._parent[self._parent[i]]
            i = self._parent[i]
        return i

    def join(self, i: int, j: int) -> None:
        self._parent[self.root(j)] = self.root(i)

    def groups(self) -> list[list[int]]:
        found: defaultdict[int, list[int]] = defaultdict(list)
        for i in range(len(self._parent)):
            found[self.root(i)].append(i)
        return list(found.values())


def _strata(plans: Dataset) -> list[tuple[int, int]]:
    """Return for each plan its stratum by rooms, and the quarter of that stratum by area."""
    rooms = np.searchsorted(ROOMS, np.array(plans.column("source_rooms")), side="right")
    area = np.array(plans.column("area"), dtype=np.float64)
    quarter = np.zeros(len(plans), dtype=int)
    for kind in np.unique(rooms):
        here = rooms == kind
        quarter[here] = np.searchsorted(np.quantile(area[here], (0.25, 0.5, 0.75)), area[here], side="right")
    return list(zip(rooms.tolist(), quarter.tolist(), strict=True))


def _check(shares: Mapping[str, float]) -> None:
    if any(not 0 <= share <= 1 for share in shares.values()) or abs(sum(shares.values()) - 1) > 1e-6:
        said = ", ".join(f"{name} {share:g}" for name, share in shares.items())
        raise ConfigError(f"split: expected shares from 0 to 1 that add up to 1, found {said}")


def _into_index(found: Split, file: Path) -> None:
    import pyarrow.parquet as pq

    from houseexpo.dataset.index import index_table

    part_of = {name: part for part, ids in found.parts.items() for name in ids}
    rows = pq.read_table(file).to_pylist()
    write_atomically(file, index_table([{**row, "split": part_of.get(row["id"])} for row in rows]))


def _into_manifest(folder: Path, files: Sequence[Path]) -> None:
    file = folder / "manifest.json"
    try:
        said = read_json(file, dict[str, Any])
        known = {name: digest for name, digest in said["files"].items() if not name.startswith("splits/")}
    except (OSError, msgspec.DecodeError, KeyError, AttributeError) as error:
        raise DatasetError(f"{file}: expected the manifest of a data set, found {error}") from None
    known |= {path.relative_to(folder).as_posix(): sha256_of(path) for path in files if path.exists()}
    write_atomically(file, encode_json({**said, "files": dict(sorted(known.items()))}))
