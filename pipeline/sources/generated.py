"""``procedural:COUNT``: houses that the project makes itself, written in SUNCG's layout and read by the SUNCG reader.

A house is made where it is read, in a scratch folder that is gone afterwards: what a build depends on is the seed and
the house's number, so that any worker can make any house.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from houseexpo.errors import ConfigError
from pipeline.sources import suncg
from pipeline.sources.procedural import scene_id, write_house
from pipeline.values import MADE, Input, Level, RejectedLevel


def find(path: str, **options: str) -> Iterator[Input]:
    """List COUNT houses of a seed, one by one; option ``seed`` (default 0)."""
    count, seed = path.partition(":")[2], options.get("seed", "0")
    if not count.isdecimal() or int(count) < 1:
        raise ConfigError(f"source {path!r}: expected procedural:COUNT with a COUNT of at least 1")
    for index in range(int(count)):
        yield Input(scene_id(index, int(seed)), "generated", "procedural", key=f"{seed}:{index}")


def read(item: Input) -> Iterator[Level | RejectedLevel]:
    """Make the house and read it back; raises Rejection as the SUNCG reader does."""
    seed, index = map(int, item.key.split(":"))
    with tempfile.TemporaryDirectory(prefix="houseexpo-") as folder:
        write_house(Path(folder), index, seed)
        for house in suncg.find(folder):
            yield from map(_as_made, suncg.read(house))


def _as_made(level: Level | RejectedLevel) -> Level | RejectedLevel:
    """Say that the project made the house: it is no house of SUNCG's."""
    if isinstance(level, RejectedLevel):
        return level
    return replace(level, provenance={**level.provenance, "source": MADE})
