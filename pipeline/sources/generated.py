"""Make the houses of the source ``procedural:COUNT``, each from the seed and its number, and yield their levels.

A house is made where it is read, so that any worker can.

``procedural:COUNT``, or ``procedural:COUNT?style=sound`` in full, makes homes in which one could live.
``procedural:COUNT?style=published`` makes homes whose numbers and shapes follow the published plans.
``procedural:COUNT?style=test`` makes houses in SUNCG's layout, in some of which the cases that the paper names as hard
are planted; they are written to a scratch folder and read by the SUNCG reader. A house depends on the seed and its
number, a home of the style ``published`` also on the statistics that such homes follow.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from houseexpo.errors import ConfigError
from pipeline.sources import suncg
from pipeline.sources.homes.home import home_id, make_home
from pipeline.sources.homes.level import level_from_home
from pipeline.sources.homes.wishes import distributions_digest
from pipeline.sources.procedural import scene_id, write_house
from pipeline.sources.reader_choice import PUBLISHED, SOUND, TEST, parse_made_houses
from pipeline.sources.sound_homes.home import make_sound_home, sound_home_id
from pipeline.sources.sound_homes.level import level_from_sound_home
from pipeline.values import MADE, Input, Level, RejectedLevel

_STYLES = (SOUND, PUBLISHED, TEST)


def find(path: str, **options: str) -> Iterator[Input]:
    """List COUNT houses of a seed, one by one; option ``seed`` (default 0)."""
    made, seed = parse_made_houses(path), options.get("seed", "0")
    if made is None or made.count < 1:
        expected = "expected procedural:COUNT or procedural:COUNT?style=STYLE with a COUNT of at least 1"
        expected += f" and a STYLE of {', '.join(_STYLES)}"
        raise ConfigError(f"source {path!r}: {expected}")
    kind = {PUBLISHED: f":home:{distributions_digest()}", SOUND: ":sound"}.get(made.style, "")
    name_of = {PUBLISHED: home_id, SOUND: sound_home_id}.get(made.style, scene_id)
    for index in range(made.count):
        name = name_of(index, int(seed))
        yield Input(name, "generated", "procedural", key=f"{seed}:{index}{kind}")


def read(item: Input) -> Iterator[Level | RejectedLevel]:
    """Make the house; one in SUNCG's layout is read back, which raises Rejection as the SUNCG reader does."""
    seed, index, *kind = item.key.split(":")
    if kind == [SOUND]:
        yield level_from_sound_home(make_sound_home(int(index), int(seed)))
        return
    if kind:
        yield level_from_home(make_home(int(index), int(seed)))
        return
    with tempfile.TemporaryDirectory(prefix="houseexpo-") as folder:
        write_house(Path(folder), int(index), int(seed))
        for house in suncg.find(folder):
            yield from map(_as_made, suncg.read(house))


def _as_made(level: Level | RejectedLevel) -> Level | RejectedLevel:
    """Say that the project made the house: it is no house of SUNCG's."""
    if isinstance(level, RejectedLevel):
        return level
    return replace(level, provenance={**level.provenance, "source": MADE})
