"""Ids of plans (docs/format.md, "Ids"): readers make them, a build sees to it that no two are equal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

DIGITS = 8


def settle(ids: Sequence[str], contents: Sequence[str]) -> list[str]:
    """Return ids of which no two are equal.

    1. An id that stands alone stays as it is.
    2. Equal ids all get eight digits of their content's hash.
    3. Where the contents are equal too, the second and later get a number as well.

    Parameters
    ----------
    ids, contents
        The readers' ids, and the SHA-256 of what each was made from (hex digits), in the same order.
    """
    count = Counter(ids)
    apart = [  # R1, R2
        name if count[name] == 1 else f"{name}_{content[:DIGITS]}" for name, content in zip(ids, contents, strict=True)
    ]
    seen: Counter[str] = Counter()
    settled = []
    for name in apart:
        seen[name] += 1
        settled.append(name if seen[name] == 1 else f"{name}_{seen[name]}")  # R3
    return settled
