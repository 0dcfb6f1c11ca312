"""A name's words, and what each of them means by itself."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from functools import cache

from pipeline.sources.name_tables import GERMANIC, ROMANCE, Role


def tokens(name: str) -> list[str]:
    """Plain words of a name: camel case parted, digits dropped, umlauts spelled out, other accents dropped."""
    parted = re.sub(r"(?<=[a-z\xdf-\xff])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", " ", name)
    for umlaut, spelled in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss"), ("Ä", "Ae"), ("Ö", "Oe"), ("Ü", "Ue")):
        parted = parted.replace(umlaut, spelled)
    plain = unicodedata.normalize("NFKD", parted).encode("ascii", "ignore").decode().lower()
    joined = re.sub(r"\bifc (?=space|opening)", "ifc", plain)
    return re.findall(r"[a-z]+", joined)


def meaning(word: str) -> Role | None:
    """Return what a Germanic or any other listed word means by itself, or None if it is not known."""
    return _germanic().get(word) or _romance().get(word)


def is_romance(word: str) -> bool:
    """Tell whether a word is known, and only in a language whose head noun comes first."""
    return word in _romance() and word not in _germanic()


@cache
def _germanic() -> Mapping[str, Role]:
    return _table(GERMANIC)


@cache
def _romance() -> Mapping[str, Role]:
    return _table(ROMANCE)


def _table(words: Mapping[Role, frozenset[str]]) -> Mapping[str, Role]:
    exact = {word: role for role, group in words.items() for word in sorted(group)}
    plural = {f"{word}{end}": role for word, role in exact.items() for end in ("s", "es", "n", "en") if len(word) > 2}
    return {**plural, **exact}
