"""Write parts of messages: a count with its noun, and the known name that is nearest to a misspelt one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Final

_NAMES_LOOKED_AT: Final = 5000  # names that are looked at; a data set may have millions of ids
_NAMES_COMPARED: Final = 20  # names that are compared letter by letter
_COMPARED_LETTERS: Final = 120  # of an unknown name that are compared and shown
_SIMILAR_SHARE: Final = 0.5  # share of common letters from which a name is similar
_FEW_NAMES: Final = 25  # names that are listed one by one


def count_noun(number: int, noun: str) -> str:
    """Return a count with its noun, in the singular or the plural.

    Examples
    --------
    >>> count_noun(1, "piece"), count_noun(0, "plan"), count_noun(33717, "plan")
    ('1 piece', '0 plans', '33,717 plans')
    """
    return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"


def suggest_name(word: str, known: Iterable[str]) -> str:
    """Return the part of a message that suggests the known name most similar to ``word``; "" if none is similar.

    Examples
    --------
    >>> suggest_name("fronteir", ["frontier", "forward"]), suggest_name("x", ["frontier"])
    ("; did you mean 'frontier'?", '')
    """
    from difflib import get_close_matches

    names = {name.lower(): name for name in known}
    found = get_close_matches(word.lower(), names, n=1, cutoff=_SIMILAR_SHARE)
    return f"; did you mean {names[found[0]]!r}?" if found else ""


def unknown_name_message(word: str, known: Sequence[str]) -> str:
    """Return the message that a name is unknown, with the most similar known name or, if there is none, what is known.

    A word is similar if it shares half of its letters with the unknown one, in the same order, or starts with it.

    Comparing two words takes a tenth of a millisecond. If many are known, only the few that share most pairs of
    neighbouring letters with the word are compared.
    """
    from difflib import get_close_matches
    from heapq import nsmallest

    word = word[:_COMPARED_LETTERS]
    pairs = _pairs(word)
    likely = nsmallest(_NAMES_COMPARED, known[:_NAMES_LOOKED_AT], key=lambda other: len(pairs ^ _pairs(other)))
    near = get_close_matches(word, likely, n=1, cutoff=_SIMILAR_SHARE)
    if not near and word:
        near = [other for other in known[:_NAMES_LOOKED_AT] if other.startswith(word)][:1]
    if near:
        return f"no {word!r}; the nearest is {near[0]!r}"
    names, are_few = list(map(repr, known[:_FEW_NAMES])), len(known) <= _FEW_NAMES
    listed = ", ".join(names if are_few else names[:3]) + ("" if are_few else " and others")
    return f"no {word!r}" + (f"; there are {listed}" if known else "")


def _pairs(word: str) -> set[tuple[str, str]]:
    return set(pairwise(word))
