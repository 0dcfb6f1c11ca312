"""Which plans of a data set are copies of each other, kept from build to build: only new plans are compared."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import msgspec
import numpy as np

from houseexpo.analysis.similarity import SYMMETRIES, Comparison, Pair, find_pairs
from houseexpo.files import write_whole
from houseexpo.floorplan import decode
from houseexpo.workers import cores
from pipeline.batch.entry import Kept
from pipeline.batch.plans import Plans
from pipeline.batch.recipe import digest_of
from pipeline.config import DedupeConfig

_NAMES = tuple(SYMMETRIES)


def copies(file: Path, plans: Plans, kept: Sequence[Kept], config: DedupeConfig) -> tuple[Pair, ...]:
    """Return all pairs within the threshold, by the plans' places in ``kept``, which is sorted by id.

    ``file`` remembers what was compared; a damaged one is as good as none.
    """
    recipe = hashlib.sha256(
        msgspec.json.encode((asdict(config), digest_of("houseexpo.analysis.similarity")))
    ).hexdigest()
    known = _read(file, recipe, {plan.plan: i for i, plan in enumerate(kept)})
    found = find_pairs(lambda i: decode(plans.get(kept[i])), len(kept), **asdict(config), known=known, threads=cores())
    if len(found.fingerprints) != len(known.fingerprints):
        write_whole(file, _bytes(recipe, kept, found), durable=True)
    return found.pairs


def _bytes(recipe: str, kept: Sequence[Kept], found: Comparison) -> bytes:
    stream = io.BytesIO()
    np.savez(
        stream,
        recipe=np.array(recipe),
        plans=np.frombuffer(bytes.fromhex("".join(plan.plan for plan in kept)), np.uint8).reshape(-1, 32),
        prints=np.array([found.fingerprints[i] for i in range(len(kept))], np.int32),
        pairs=np.array([pair[:2] for pair in found.pairs], np.int32).reshape(-1, 2),
        differences=np.array([pair.difference for pair in found.pairs], np.float64),
        symmetries=np.array([_NAMES.index(pair.symmetry) for pair in found.pairs], np.uint8),
    )
    return stream.getvalue()


def _read(file: Path, recipe: str, places: dict[str, int]) -> Comparison:
    """Return what is known of the plans that have a place, by their places."""
    try:
        with np.load(io.BytesIO(file.read_bytes())) as found:
            if str(found["recipe"]) != recipe:
                return Comparison()
            now = [places.get(row.tobytes().hex(), -1) for row in found["plans"]]
            prints = {place: row for place, row in zip(now, found["prints"], strict=True) if place >= 0}
            pairs = [
                Pair(now[first], now[second], float(difference), _NAMES[symmetry])
                for (first, second), difference, symmetry in zip(
                    found["pairs"], found["differences"], found["symmetries"], strict=True
                )
                if now[first] >= 0 and now[second] >= 0
            ]
    except (OSError, ValueError, KeyError, EOFError, IndexError, zipfile.BadZipFile):
        return Comparison()
    return Comparison(prints, tuple(pairs))
