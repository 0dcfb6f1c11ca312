"""Damaged copies of a file: cut short, bytes changed, spans lost, doubled or swapped, numbers made absurd."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.values import Level, RejectedLevel

NUMBERS = (b"1e308", b"-1e308", b"NaN", b"0", b"-1", b"99999999999999999999", b'"x"', b"null", b"[]", b"{}")


def mutated(data: bytes, count: int, seed: int) -> Iterator[bytes]:
    """Yield ``count`` damaged copies; the seed says which."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        yield DAMAGES[number % len(DAMAGES)](data, rng)


def outcome(path: Path, **options: str) -> list[Level | RejectedLevel] | Rejection:
    """What a build would have of a file: its levels, or the first rejection; any other error is a fault."""
    try:
        return [level for item in find(str(path), **options) for level in reader(item.reader).read(item)]
    except Rejection as error:
        rejection = error
    assert rejection.stage == "source"
    assert rejection.detail
    assert rejection.advice
    return rejection


def _place(data: bytes, rng: np.random.Generator) -> tuple[int, int]:
    start = int(rng.integers(len(data)))
    return start, min(start + int(rng.integers(1, 200)), len(data))


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: int(rng.integers(1, len(data)))]


def _bytes(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 8))):
        changed[int(rng.integers(len(data)))] = int(rng.integers(256))
    return bytes(changed)


def _lost(data: bytes, rng: np.random.Generator) -> bytes:
    start, end = _place(data, rng)
    return data[:start] + data[end:]


def _doubled(data: bytes, rng: np.random.Generator) -> bytes:
    start, end = _place(data, rng)
    return data[:end] + data[start:end] + data[end:]


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    found = list(re.finditer(rb"-?\d+(\.\d+)?", data))
    if not found:
        return _bytes(data, rng)
    match = found[int(rng.integers(len(found)))]
    return data[: match.start()] + NUMBERS[int(rng.integers(len(NUMBERS)))] + data[match.end() :]


DAMAGES = (_cut, _bytes, _lost, _doubled, _number)
"""The ways to damage bytes; each takes them and a source of chance."""
