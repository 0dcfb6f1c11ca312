"""Which house is what: every hundred houses hold each difficulty in the same share, at places that the seed chooses."""

from __future__ import annotations

import hashlib
from typing import Final

import numpy as np

SOUND: Final = "sound"
DUPLICATES: Final = ("exact_duplicate", "shifted_duplicate", "mirrored_duplicate", "jittered_duplicate")
PER_HUNDRED: Final = {
    "closed_cell": 5,
    "no_door": 5,
    "garage_apart": 4,
    "open_front": 4,
    "half_open_front": 4,
    "objects_only": 4,
    "characters": 4,
    "exact_duplicate": 4,
    "shifted_duplicate": 2,
    "mirrored_duplicate": 2,
    "jittered_duplicate": 2,
}
_ROLES: Final = [role for role, count in PER_HUNDRED.items() for _ in range(count)]
_BLOCK: Final = 100
_LOOK_BACK: Final = 60


def scene_id(index: int, seed: int) -> str:
    """Return the 32 hex digits of a house."""
    return hashlib.sha256(f"houseexpo procedural {seed} {index}".encode()).hexdigest()[:32]


def role_of(index: int, seed: int) -> str:
    """Return what is planted in a house, "sound" for nothing; a duplicate without a house before it is sound."""
    role = _drawn(index, seed)
    return SOUND if role in DUPLICATES and not _originals(index, seed) else role


def original_of(index: int, seed: int) -> int:
    """Return the index of the sound house that a duplicate repeats."""
    choices = _originals(index, seed)
    return choices[int(np.random.default_rng([seed, index, 2]).integers(len(choices)))]


def _originals(index: int, seed: int) -> list[int]:
    return [k for k in range(max(0, index - _LOOK_BACK), index) if _drawn(k, seed) == SOUND]


def _drawn(index: int, seed: int) -> str:
    order = np.random.default_rng([seed, index // _BLOCK, 1]).permutation(_BLOCK)
    place = int(order[index % _BLOCK])
    return _ROLES[place] if place < len(_ROLES) else SOUND
