"""Assign a colour's number to each policy of a comparison, for the curves of its pages.

R1  A policy has one colour in all pictures of a comparison. Trainings of one family are one policy.
R2  The project's policies have the same colours in all comparisons. Others have one by their name, or the next free
    one.
R3  Two policies of one picture share a colour only if it has more policies than there are colours.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Final, TypeAlias

from houseexpo.drawing.plots import SERIES
from houseexpo.pseudoslam.benchmark.comparison import ComparisonRow, TrackComparison

Colours: TypeAlias = Mapping[tuple[str, int], int]
"""The number of the colour of each policy: by its name, and by how many of that name came before it in a table."""

_OWN: Final = {
    "frontier": 0, "chooser": 1, "information": 2, "oracle": 3, "tour": 4, "wall": 5, "forward": 6, "random": 7,
    "frontier-mapex": 8, "random-frontier": 8, "PPO set": 9, "PPO cnn": 10, "PPO cnn-lstm": 11,
}  # fmt: skip


def assign_colours(found: Sequence[TrackComparison]) -> Colours:
    """Return the colours of the policies of a comparison."""
    beside: dict[tuple[str, int], set[tuple[str, int]]] = {}
    for compared in found:
        drawn = {
            key for key, entry in zip(colour_keys(compared), compared.plain, strict=True) if _is_drawn(compared, entry)
        }
        for key in drawn:
            beside.setdefault(key, set()).update(drawn - {key})
    colours: dict[tuple[str, int], int] = {}
    for key in sorted(beside, key=lambda key: (key[1] > 0, _own(key[0]) is None, key)):
        own = _own(key[0])
        wanted = int(hashlib.sha256(key[0].encode()).hexdigest(), 16) % len(SERIES) if own is None else own
        taken = {colours[other] for other in beside[key] if other in colours}
        colours[key] = next((n for k in range(len(SERIES)) if (n := (wanted + k) % len(SERIES)) not in taken), wanted)
    return colours


def colour_keys(compared: TrackComparison) -> list[tuple[str, int]]:
    """Return the keys of the rows of ``compared.plain`` in ``Colours``."""
    names = [_name(entry) for entry in compared.plain]
    return [(name, names[:number].count(name)) for number, name in enumerate(names)]


def _is_drawn(compared: TrackComparison, entry: ComparisonRow) -> bool:
    return any(entry.has_curve(over) for over, _ in compared.track.curves)


def _name(entry: ComparisonRow) -> str:
    policy = entry.results[0].policy
    return policy.family or policy.name


def _own(name: str) -> int | None:
    """Return the colour of one of the project's policies; a family's name ends in a hash of its training."""
    return _OWN.get(name.rpartition(" ")[0] if name.startswith("PPO ") else name)
