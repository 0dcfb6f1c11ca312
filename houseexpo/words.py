"""Wording of messages: counts with their noun, and suggestions for misspelt names."""

from __future__ import annotations

from collections.abc import Iterable


def counted(number: int, noun: str) -> str:
    """Return a count with its noun, in the singular or the plural.

    Examples
    --------
    >>> counted(1, "piece"), counted(0, "plan"), counted(33717, "plan")
    ('1 piece', '0 plans', '33,717 plans')
    """
    return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"


def nearest(word: str, known: Iterable[str]) -> str:
    """Return the part of a message that suggests the known name most similar to ``word``; "" if none is similar.

    Examples
    --------
    >>> nearest("fronteir", ["frontier", "forward"]), nearest("x", ["frontier"])
    ("; did you mean 'frontier'?", '')
    """
    from difflib import get_close_matches

    names = {name.lower(): name for name in known}
    found = get_close_matches(word.lower(), names, n=1, cutoff=0.5)
    return f"; did you mean {names[found[0]]!r}?" if found else ""
