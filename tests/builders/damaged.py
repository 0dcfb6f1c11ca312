"""A folder of damaged houses: each a house of its own, with one file cut short, changed, or made absurd by a seed.

The houses are the kit's, three of each kind that is small, the examples of each source, houses in SUNCG's layout,
and the small files of the shared data where they are at hand.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.sources.procedural import write_house
from tests.builders.batch import contents, lines
from tests.builders.examples import FOLDER
from tests.builders.kinds.registry import KINDS, RAW, make_member
from tests.builders.mutations import DAMAGES
from tests.builders.shared import DATA

LARGEST = 1 << 20
"""Bytes of a house that is damaged: larger ones take long and show nothing else."""

_KINDS = [kind for kind in KINDS | RAW if not kind.startswith(("scan", "cloud", "office"))]
_HEADER = 2048
_HUGE = (0x7FFFFFFF, 0xFFFFFFFF, 0x10000000)
_TEXTS = (b"2147483647", b"99999999999999999999", b"-1", b"1e308")

Damage = Callable[[bytes, np.random.Generator], bytes]


@dataclass(frozen=True)
class Victim:
    """A house on disk: its folder, and which of its files are damaged."""

    folder: Path
    files: tuple[str, ...]


def damaged_houses(folder: Path, count: int, seed: int) -> tuple[Path, Path]:
    """Write ``count`` damaged houses; return the folder of files, and the SUNCG root beside it."""
    plain, suncg = folder / "files", folder / "suncg"
    victims = _victims(folder / "whole", seed)
    houses = _suncg_houses(suncg, count // 10, seed)
    rng = np.random.default_rng(seed)
    damages = (*DAMAGES, _reordered, _huge_count)
    for number in range(count - houses):
        victim, damage = victims[number % len(victims)], damages[int(rng.integers(len(damages)))]
        place = plain / f"{number:04d}"
        shutil.copytree(victim.folder, place)
        _damage(place / victim.files[int(rng.integers(len(victim.files)))], damage, rng)
    return plain, suncg


@dataclass(frozen=True)
class Attacked:
    """What a build of damaged houses did: ``said`` on the console, ``written`` in its files, refused line by line."""

    inputs: int
    seconds: float
    code: int
    said: str
    written: str
    refused: list[dict[str, Any]]

    @property
    def reasons(self) -> Counter[str]:
        """How many were refused for each reason."""
        return Counter(each["reason"] for each in self.refused)


def build_damaged(folder: Path, count: int, seed: int, limit_s: int = 10) -> Attacked:
    """Build so many damaged houses in one go, as a person would."""
    sources, out, manifest = damaged_houses(folder, count, seed), folder / "out", folder / "houses.toml"
    listed = ", ".join(f'"{source}"' for source in sources)
    manifest.write_text(f"[build]\nsources = [{listed}]\n\n[limits]\nseconds = {limit_s}\n")
    command = [sys.executable, "-m", "houseexpo", "build", "--config", str(manifest), "--out", str(out)]
    start = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    seconds = time.monotonic() - start
    inputs = len(list(sources[0].iterdir())) + len(list((sources[1] / "house").iterdir()))
    written = b"\n".join(contents(out).values()).decode(errors="replace")
    refused = lines(out / "rejected.jsonl")
    return Attacked(inputs, seconds, done.returncode, done.stdout + done.stderr, written, refused)


def _victims(folder: Path, seed: int) -> list[Victim]:
    """Write three houses of each kind, and copy the files that stand ready; each has a folder of its own."""
    for kind in _KINDS:
        for number in range(3):
            make_member(kind, number, seed, folder / f"{kind}_{number}")
    ready = [file for file in sorted(FOLDER.glob("*.*")) if file.suffix not in {".png", ".md", ".toml"}]
    real = [file for file in sorted(DATA.glob("real/**/*.*")) if file.suffix in {".glb", ".ply", ".obj", ".dae"}]
    for file in (*ready, *real):
        place = folder / f"{file.stem}_{file.suffix[1:]}"
        place.mkdir(exist_ok=True)
        shutil.copy(file, place)
    found = []
    for place in sorted(folder.iterdir()):
        files = [file for file in sorted(place.rglob("*")) if file.is_file()]
        if sum(file.stat().st_size for file in files) < LARGEST:
            found.append(Victim(place, tuple(file.relative_to(place).as_posix() for file in files)))
    return found


def _suncg_houses(root: Path, count: int, seed: int) -> int:
    """Write houses in SUNCG's layout and damage a file of each."""
    rng = np.random.default_rng([seed, 1])
    for number in range(count):
        write_house(root, number, seed)
    for number, file in enumerate(sorted(root.glob("house/*/house.json"))):
        parts = [file, *sorted((root / "room" / file.parent.name).glob("*"))]
        _damage(parts[int(rng.integers(len(parts)))], DAMAGES[number % len(DAMAGES)], rng)
    return count


def _damage(file: Path, damage: Damage, rng: np.random.Generator) -> None:
    data = file.read_bytes()
    file.write_bytes(damage(data, rng) if data else b"\0")


def _reordered(data: bytes, rng: np.random.Generator) -> bytes:
    """Swap two blocks: lines of a text, spans of anything else."""
    size = max(len(data) // 8, 1)
    a, b = sorted(int(k) for k in rng.integers(0, 8, 2))
    blocks = [data[k * size : (k + 1) * size if k < 8 else None] for k in range(9)]
    blocks[a], blocks[b] = blocks[b], blocks[a]
    return b"".join(blocks)


def _huge_count(data: bytes, rng: np.random.Generator) -> bytes:
    """Let the header promise more than any file holds: in a text a number, in a binary file four bytes."""
    head = data[:_HEADER]
    numbers = list(re.finditer(rb"(?<![\w.-])\d+(?![\w.])", head))
    if numbers and b"\0" not in head:
        match = numbers[int(rng.integers(len(numbers)))]
        return data[: match.start()] + _TEXTS[int(rng.integers(len(_TEXTS)))] + data[match.end() :]
    start = 4 * int(rng.integers(min(len(head), 256) // 4 + 1))
    return data[:start] + _HUGE[int(rng.integers(len(_HUGE)))].to_bytes(4, "little") + data[start + 4 :]
