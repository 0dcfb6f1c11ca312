"""Write pairs of partial and complete maps of a data set with several processes: npz shards, then a manifest.

R1  A pair depends only on the recipe and its number, not on the processes that make pairs.
R2  A shard gets its name when it is complete. A damaged one, or one with another number of pairs, is made again.
R3  ``manifest.json`` is written last, with the hashes of all shards; if it exists, all shards do.
R4  A folder contains pairs of one recipe, which is written to ``recipe.json`` at the start.
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import lru_cache, partial
from itertools import islice
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from houseexpo.dataset import Dataset
from houseexpo.errors import ConfigError, HouseExpoError
from houseexpo.files import encode_json, make_folder, write_atomically
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.outputs import check_run_folder, first_difference
from houseexpo.processes import map_in_processes
from houseexpo.progress import show_progress
from houseexpo.pseudoslam.config import SimulatorConfig
from houseexpo.pseudoslam.io.pairs import ROOM_LABELS, Pair, PairConfig, simulate_pairs, stack_pairs
from houseexpo.pseudoslam.worlds.cache import finish_world, load_static_world
from houseexpo.pseudoslam.worlds.store import WorldStore

SHARD_VERSION: Final = 1
EPISODES: Final = 100
"""Number of episodes of a shard. It has ``PairConfig.each`` pairs per episode, except for the last shard and for houses
in which the robot does not fit."""
RECIPE, MANIFEST = "recipe.json", "manifest.json"
_ZIP_LEVEL: Final = 1
"""Compression level; higher ones take three times as long for files that are a tenth smaller."""


class HouseVisit(NamedTuple):
    """One visit to a house: its number, the plan's JSON and its hash, and the largest number of pairs."""

    number: int
    plan: bytes
    digest: bytes
    pairs: int


Job: TypeAlias = tuple[int, list[HouseVisit]]
"""A shard's number, and its episodes."""


@dataclass(frozen=True)
class PairShardsReport:
    """The result: numbers of existing and new shards, of pairs and of bytes, and why houses have no pairs."""

    known: int
    made: int
    pairs: int
    refused: tuple[str, ...]
    size: int


def write_pair_shards(
    plans: Dataset, out: Path, config: PairConfig, *, limit: int | None = None, seed: int = 0, workers: int = 1
) -> PairShardsReport:
    """Write pairs of maps of a data set to a folder; an interrupted run continues where it stopped.

    All plans are visited once, in a random order that the seed determines, before any is visited again. With several
    workers, a script needs ``if __name__ == "__main__"``.

    Parameters
    ----------
    limit
        Largest number of pairs; None for one episode in each plan.

    Raises
    ------
    ConfigError
        The folder holds something else, or a number is too small.
    """
    if not len(plans):
        raise ConfigError("observe: expected at least one plan, found none")
    wanted = config.each * len(plans) if limit is None else limit
    if wanted < 1:
        raise ConfigError(f"limit: expected at least 1 pair, found {wanted}")
    recipe = _recipe(plans, config, wanted, seed)
    make_folder(out)
    _claim(out, recipe)
    (out / MANIFEST).unlink(missing_ok=True)  # R3
    shards = math.ceil(wanted / (config.each * EPISODES))
    found = {shard: made for shard in range(shards) if (made := _read_entry(out, shard, config)) is not None}
    known = len(found)
    jobs = ((shard, _episodes(plans, shard, config, wanted, seed)) for shard in range(shards) if shard not in found)
    work = partial(_write_shard, out, config, seed)
    found |= dict(show_progress(_run(work, jobs, shards - known, workers), "observing", shards - known))
    entries = [found[shard] for shard in range(shards)]
    write_atomically(
        out / MANIFEST, encode_json({**recipe, "pairs": sum(each["pairs"] for each in entries), "shards": entries})
    )
    refused = tuple(line for entry in entries for line in entry["refused"])
    size = sum((out / entry["file"]).stat().st_size for entry in entries)
    return PairShardsReport(known, shards - known, sum(entry["pairs"] for entry in entries), refused, size)


def _recipe(plans: Dataset, config: PairConfig, wanted: int, seed: int) -> dict[str, Any]:
    """Return everything that determines the bytes of the pairs, and the description of their arrays."""
    digests = hashlib.sha256(b"".join(map(plans.digest, range(len(plans)))))
    made = {name: value for name, value in asdict(config).items() if name != "simulator"}
    return {
        "version": SHARD_VERSION,
        "plans": {"number": len(plans), "sha256": digests.hexdigest()},
        "seed": seed,
        "wanted": wanted,
        "episodes_a_shard": EPISODES,
        "config": {**made, "simulator": config.simulator.to_mapping()},
        "arrays": {name: {"dtype": kind, "shape": ["pairs", *shape]} for name, (kind, shape) in config.arrays().items()}
        | {"plan_id": {"dtype": "str", "shape": ["pairs"]}},
        "labels": ["", *ROOM_LABELS],
    }


def _claim(out: Path, recipe: dict[str, Any]) -> None:
    """Write the recipe; raise ConfigError if the folder has another one (R4)."""
    file = out / RECIPE
    if not file.exists():
        check_run_folder(out, [RECIPE])
        write_atomically(file, encode_json(recipe))
        return
    try:
        there = json.loads(file.read_bytes())
    except ValueError as error:
        raise ConfigError(f"{file}: expected JSON, found: {error}; name another folder") from None
    other = first_difference(there if isinstance(there, dict) else {}, json.loads(encode_json(recipe)))
    if other is not None:
        key, found, asked = other
        raise ConfigError(
            f"{out}: expected pairs of the same recipe, found a different {'limit' if key == 'wanted' else key!r} in "
            f"{RECIPE}: {found!r} there, {asked!r} asked for; name another folder"
        )


def _episodes(plans: Dataset, shard: int, config: PairConfig, wanted: int, seed: int) -> list[HouseVisit]:
    """Return the episodes of a shard."""
    first, found = shard * EPISODES, []
    for number in range(first, min(first + EPISODES, math.ceil(wanted / config.each))):
        turn, place = divmod(number, len(plans))
        row = int(_order(seed, turn, len(plans))[place])
        pairs = min(config.each, wanted - number * config.each)
        found.append(HouseVisit(number, plans.raw_of(row), plans.digest(row), pairs))
    return found


@lru_cache(maxsize=2)
def _order(seed: int, turn: int, number: int) -> npt.NDArray[np.int64]:
    """Return the order of the plans in one round through all of them."""
    return np.random.default_rng([seed, turn]).permutation(number)


def _run(
    work: Callable[[Job], tuple[int, dict[str, Any]]], jobs: Iterator[Job], number: int, workers: int
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the manifest's entries of shards as they are made."""
    if workers <= 1 or number <= 1:
        yield from map(work, jobs)
        return
    yield work(next(jobs))  # the first job compiles the kernels once
    yield from map_in_processes(work, jobs, workers)


def _write_shard(out: Path, config: PairConfig, seed: int, job: Job) -> tuple[int, dict[str, Any]]:
    """Make the pairs of a shard, and write it; return its number and its entry in the manifest."""
    shard, episodes = job
    pairs, plan_ids, refused = list[Pair](), list[str](), list[str]()
    for episode in episodes:
        try:
            plan = decode(episode.plan)
            found = _pairs(plan, episode, config, seed)
        except HouseExpoError as error:
            refused.append(str(error))
            continue
        pairs += found
        plan_ids += [plan.id] * len(found)
    data = _npz({**stack_pairs(pairs, config), "plan_id": np.array(plan_ids, np.str_)}, {"refused": refused})
    write_atomically(_file(out, shard), data)
    return shard, _entry(shard, data, len(pairs), refused)


def _pairs(plan: FloorPlan, episode: HouseVisit, config: PairConfig, seed: int) -> list[Pair]:
    world = _store(config.simulator).get(episode.digest) or load_static_world(plan, config.simulator)
    rng = np.random.default_rng([seed, 1, episode.number])  # R1
    world = finish_world(world, plan, config.simulator)
    return list(islice(simulate_pairs(plan, world, config, rng), episode.pairs))


@lru_cache(maxsize=1)
def _store(config: SimulatorConfig) -> WorldStore:
    """Return the prepared worlds, if any; no worlds are added."""
    return WorldStore(config)


def _file(out: Path, shard: int) -> Path:
    return out / f"pairs-{shard:06d}.npz"


def _entry(shard: int, data: bytes, pairs: int, refused: list[str]) -> dict[str, Any]:
    digest = hashlib.sha256(data).hexdigest()
    return {"file": _file(Path(), shard).name, "pairs": pairs, "sha256": digest, "refused": refused}


def _read_entry(out: Path, shard: int, config: PairConfig) -> dict[str, Any] | None:
    """Return the manifest's entry of an existing, complete shard, else None (R2)."""
    try:
        data = _file(out, shard).read_bytes()
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            refused = json.loads(archive.comment)["refused"]
            if archive.testzip() is not None:
                return None
        with np.load(io.BytesIO(data)) as arrays:
            lengths = {len(arrays[name]) for name in (*config.arrays(), "plan_id")}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return _entry(shard, data, lengths.pop(), refused) if len(lengths) == 1 else None


def _npz(arrays: dict[str, npt.NDArray[Any]], comment: dict[str, Any]) -> bytes:
    """Return arrays as ``numpy.load`` takes them, the same bytes each time; the comment is the archive's."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=_ZIP_LEVEL) as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, array, allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue(), zipfile.ZIP_DEFLATED, _ZIP_LEVEL)
        archive.comment = json.dumps(comment).encode()
    return stream.getvalue()
