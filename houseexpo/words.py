"""How numbers of things are said."""

from __future__ import annotations


def counted(number: int, noun: str) -> str:
    """Return a number of things.

    Examples
    --------
    >>> counted(1, "piece"), counted(0, "plan"), counted(33717, "plan")
    ('1 piece', '0 plans', '33,717 plans')
    """
    return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"
