"""Damaged houses: levels damaged as files are, files cut short or changed, and folders of them.

One of these, at random; what is known of the house stays true of it.

R1  Holes: all faces around some places are gone. R2  Noise on all vertices. R3  All that stands above a height between
1.9 and 2.3 m is gone, lintels among it. R4  Some bodies are gone. R5  Heights are squeezed or stretched, as where a
unit is wrong in one axis. R6  What the source names is not named. R7  Holes, and no floor.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from pipeline.geometry.meshes import Bodies
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.values import Level, Mesh, RejectedLevel
from tests.builders.batch import contents, lines
from tests.builders.examples import FOLDER
from tests.builders.kinds.registry import KINDS, RAW, make_member
from tests.builders.shared import DATA
from tests.builders.suncg_houses import write_house


def damaged(level: Level, rng: Generator) -> Level:
    """Return a level with one kind of damage."""
    if not len(level.walls.faces):
        return level
    damage = (_holes, _noise, _without_tops, _without_bodies, _squeezed, _unnamed, _holes_without_floor)
    return damage[int(rng.integers(len(damage)))](level, rng)


def _holes(level: Level, rng: Generator) -> Level:
    """R1."""
    faces = level.walls.faces
    centres = level.walls.vertices[faces].mean(axis=1)
    keep = np.ones(len(faces), np.bool_)
    for centre in centres[rng.integers(len(centres), size=int(rng.integers(2, 12)))]:
        keep &= np.hypot(*(centres - centre)[:, :2].T) > rng.uniform(0.2, 0.9)
    return _with(level, faces=faces[keep])


def _noise(level: Level, rng: Generator) -> Level:
    """R2."""
    vertices = level.walls.vertices
    return _with(level, vertices=vertices + rng.normal(0.0, rng.choice([0.01, 0.02, 0.04]), vertices.shape))


def _without_tops(level: Level, rng: Generator) -> Level:
    """R3."""
    vertices, faces, top = level.walls.vertices.copy(), level.walls.faces, float(rng.uniform(1.9, 2.3))
    faces = faces[vertices[faces][:, :, 2].min(axis=1) < top]
    vertices[:, 2] = np.minimum(vertices[:, 2], top)
    return replace(_with(level, vertices, faces), ceiling_m=top)


def _without_bodies(level: Level, rng: Generator) -> Level:
    """R4."""
    bodies, share = Bodies.of(level.walls), rng.choice([0.03, 0.08, 0.15])
    return replace(level, walls=bodies.without([k for k in range(len(bodies.low)) if rng.random() < share]))


def _squeezed(level: Level, rng: Generator) -> Level:
    """R5."""
    return _with(level, vertices=level.walls.vertices * [1.0, 1.0, rng.choice([0.75, 0.85, 1.2, 1.35])])


def _unnamed(level: Level, rng: Generator) -> Level:
    """R6."""
    return replace(level, openings=(), leaves=(), named_openings=False)


def _holes_without_floor(level: Level, rng: Generator) -> Level:
    """R7."""
    return replace(_holes(level, rng), floor=None)


def _with(
    level: Level,
    vertices: np.ndarray[tuple[int, ...], np.dtype[np.float64]] | None = None,
    faces: np.ndarray[tuple[int, ...], np.dtype[np.int64]] | None = None,
) -> Level:
    walls = level.walls
    mesh = Mesh(walls.vertices if vertices is None else vertices, walls.faces if faces is None else faces)
    return replace(level, walls=mesh)


# Damaged copies of a file: cut short, bytes changed, spans lost, doubled or swapped, numbers made absurd.


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


def rejected(path: Path, **options: str) -> Rejection:
    """Return why a file gives nothing."""
    found = outcome(path, **options)
    assert isinstance(found, Rejection)
    return found


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


# A folder of damaged houses: each a house of its own, with one file cut short, changed, or made absurd by a seed.
#
# The houses are the kit's, three of each kind that is small, the examples of each source, houses in SUNCG's layout,
# and the small files of the shared data where they are at hand.


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
