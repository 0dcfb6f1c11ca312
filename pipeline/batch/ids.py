"""Ids of plans (docs/format.md, "Ids"): readers make them, a build sees to it that no two are equal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import chain, count

DIGITS = 8


def settle(ids: Sequence[str], contents: Sequence[str]) -> list[str]:
    """Return ids of which no two are equal, also where a file system does not tell upper from lower case.

    1. An id that stands alone stays as it is.
    2. Equal ids all get eight digits of their content's hash.
    3. An id that is taken all the same gets a number as well, the first one that makes it new.

    Parameters
    ----------
    ids, contents
        The readers' ids, and the SHA-256 of what each was made from (hex digits), in the same order.
    """
    times = Counter(map(str.casefold, ids))
    alone = [times[name.casefold()] == 1 for name in ids]
    taken = {name.casefold() for name, only in zip(ids, alone, strict=True) if only}
    settled = []
    for name, content, only in zip(ids, contents, alone, strict=True):
        if only:
            settled.append(name)  # R1
            continue
        apart = f"{name}_{content[:DIGITS]}"  # R2
        numbered = (f"{apart}_{number}" for number in count(2))  # R3
        free = next(each for each in chain([apart], numbered) if each.casefold() not in taken)
        taken.add(free.casefold())
        settled.append(free)
    return settled
