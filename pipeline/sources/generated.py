"""Make the homes of the source ``procedural:COUNT``, each from the seed and its number, and yield their levels.

A home is made where it is read, so that any worker can.

``procedural:COUNT``, or ``procedural:COUNT?style=sound`` in full, makes homes in which one could live.
``procedural:COUNT?style=published`` makes homes whose numbers and shapes follow the published plans. A home depends on
the seed and its number, one of the style ``published`` also on the statistics that such homes follow.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from houseexpo.errors import ConfigError
from pipeline.sources.homes.home import home_id, make_home
from pipeline.sources.homes.level import level_from_home
from pipeline.sources.homes.wishes import distributions_digest
from pipeline.sources.reader_choice import PUBLISHED, SOUND, TEST, parse_made_houses
from pipeline.sources.sound_homes.home import make_sound_home, sound_home_id
from pipeline.sources.sound_homes.level import levels_of_sound_home
from pipeline.values import Input, Level

_MOST: Final = 10_000_000
"""Homes of one build: their ids alone take some GB, since all are listed first. More is a slip of the key."""


def find(path: str, **options: str) -> Iterator[Input]:
    """List COUNT homes of a seed, one by one; option ``seed`` (default 0)."""
    made, seed = parse_made_houses(path), options.get("seed", "0")
    expected = f"a STYLE of {SOUND}, {PUBLISHED}"
    if made is None or not 1 <= made.count <= _MOST:
        forms = f"expected procedural:COUNT or procedural:COUNT?style=STYLE with a COUNT of 1 to {_MOST:,} and"
        raise ConfigError(f"source {path!r}: {forms} {expected}")
    if made.style == TEST:
        raise ConfigError(
            f"source {path!r}: test houses are no longer made; expected {expected}; "
            "plans that were built of them open as before"
        )
    kind = SOUND if made.style == SOUND else f"home:{distributions_digest()}"
    name_of = sound_home_id if made.style == SOUND else home_id
    for index in range(made.count):
        yield Input(name_of(index, int(seed)), "generated", "procedural", key=f"{seed}:{index}:{kind}")


def read(item: Input) -> Iterator[Level]:
    """Make the home."""
    seed, index, kind = item.key.split(":", maxsplit=2)
    if kind == SOUND:
        yield from levels_of_sound_home(make_sound_home(int(index), int(seed)))
    else:
        yield level_from_home(make_home(int(index), int(seed)))
