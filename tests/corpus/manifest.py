"""The list of the corpus: which files it has, where they were published, and what a person thinks of their plans.

``manifest.toml`` is a list of ``[[file]]`` tables, one for each file, with the fields of ``File``. The files of the
first half come first.

Rules:

1. A hash of the repository's name puts a file into one of two halves, so that files of one author are never parted. On
   the first half everything may be studied and fitted. Files of the second half are only counted: reports do
   not show their names, and nobody works on them.
2. A file is the one that was judged if its SHA-256 is the same; any other file of that name is left out. Of a robot's
   map, whose file says little, the SHA-256 is that of its picture: the first of what it needs.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import tomllib
from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import msgspec

from houseexpo.errors import ConfigError
from houseexpo.files import sha256_of

MANIFEST: Final = Path(__file__).parent / "manifest.toml"
KINDS: Final = (
    "ifc",
    "artist",
    "scan",
    "cloud",
    "gazebo",
    "webots",
    "thor",
    "habitat",
    "sweethome",
    "front3d",
    "roomplan",
    "map",
    "drawing",
    "scene",
)
"""``artist``: a modelled house or room, games included. ``scan``: a scanned surface. ``thor``: JSON of AI2-THOR,
ProcTHOR or Holodeck. ``map``: a robot's map, its ``map.yaml``. ``drawing``: a plan that was drawn, lines or a picture.
``scene``: a scene of a simulator that has no kind of its own."""

HOST: Final = "https://github.com/"

_HEAD: Final = """\
# The corpus of real houses: docs/contributing/corpus.md says what this is. Written by tests/corpus/manifest.py.
"""
_SECOND: Final = """\


# ---------------------------------------------------------------------------------------------------------------------
# The second half. It only counts: if you work on the pipeline, please read no further.
# ---------------------------------------------------------------------------------------------------------------------
"""


class Verdict(StrEnum):
    """What a person thinks of what the program made of a file."""

    RIGHT = "right"
    PARTLY = "partly"
    WRONG = "wrong"
    REJECTED_WRONGLY = "rejected wrongly"
    REJECTED_RIGHTLY = "rejected rightly"
    PLAN_OF_NO_HOUSE = "plan of no house"
    OPEN = ""
    """Nobody has looked at it yet."""


WITH_INTERIOR: Final = (Verdict.RIGHT, Verdict.PARTLY, Verdict.WRONG, Verdict.REJECTED_WRONGLY)
WITHOUT_INTERIOR: Final = (Verdict.REJECTED_RIGHTLY, Verdict.PLAN_OF_NO_HOUSE)


class File(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A file of the corpus.

    ``name`` is short and unique. ``repository`` is ``owner/name`` on GitHub, ``path`` the file in it, ``commit`` where
    it was found ("" where that is not known), ``licence`` what the repository states. ``needs`` are other paths of the
    repository that the file refers to: buffers, materials, models, a map's picture; a folder stands for all that is in
    it. ``models``
    are folders of the repository in which a world's models are looked for (they are part of ``needs``). ``shows`` says
    in a few words what is in the file. ``interior``: whether a plan can be made of it at all. ``verdict``, ``why`` and
    ``seen`` are what a person thought of the outcome ``seen``, one line for each plan and each rejection
    (``runs.Outcome.lines``).
    """

    name: str
    repository: str
    path: str
    sha256: str
    kind: str
    interior: bool
    shows: str = ""
    commit: str = ""
    licence: str = "none stated"
    needs: list[str] = []
    models: list[str] = []
    verdict: Verdict = Verdict.OPEN
    why: str = ""
    seen: list[str] = []

    @property
    def half(self) -> int:
        """The half that the file belongs to, 1 or 2 (R1)."""
        return 1 + hashlib.sha256(self.repository.lower().encode()).digest()[0] % 2

    @property
    def key(self) -> str:
        """What stands for the file where its name must not be shown."""
        return self.sha256[:12]

    def place(self, folder: Path) -> Path:
        """Return where the file lies in a folder of checkouts."""
        return checkout(folder, self.repository) / self.path

    def is_in(self, folder: Path) -> bool:
        """Whether the very file lies in a folder of checkouts (R2)."""
        place = self.place(folder)
        told = checkout(folder, self.repository) / self.needs[0] if self.kind == "map" and self.needs else place
        return place.is_file() and told.is_file() and sha256_of(told) == self.sha256


def checkout(folder: Path, repository: str) -> Path:
    """Return the folder of a repository's checkout: ``owner+name``."""
    return folder / repository.replace("/", "+")


def fetch(files: Iterable[File], folder: Path, host: str = HOST) -> list[str]:
    """Check files out that are not in a folder yet, with what they need; return a line on each that cannot be had.

    Only the files themselves are transferred, not the repositories. It takes git.
    """
    failed = []
    for file in files:
        if file.is_in(folder):
            continue
        try:
            _check_out(file, checkout(folder, file.repository), host)
        except subprocess.CalledProcessError as error:
            said = error.stderr.decode(errors="replace").strip().splitlines()
            failed.append(f"{file.repository} {file.path}: {said[-1] if said else error}")
        else:
            if not file.is_in(folder):
                failed.append(f"{file.repository} {file.path}: not the file that was judged (its SHA-256 differs)")
    return failed


def _check_out(file: File, place: Path, host: str) -> None:
    def git(*words: str) -> None:
        subprocess.run(("git", "-C", place, *words), check=True, capture_output=True)

    if not (place / ".git").exists():
        place.mkdir(parents=True, exist_ok=True)
        git("init", "--quiet")
        git("remote", "add", "origin", f"{host}{file.repository}")
        git("config", "remote.origin.promisor", "true")
        git("config", "remote.origin.partialclonefilter", "blob:none")
    commit = file.commit or "HEAD"
    git("fetch", "--quiet", "--depth=1", "--filter=blob:none", "origin", commit)
    git("checkout", "--quiet", "FETCH_HEAD", "--", file.path, *file.needs)


def load(path: Path = MANIFEST) -> list[File]:
    """Read a manifest.

    Raises
    ------
    ConfigError
        Where it cannot be read, or an entry has an unknown field, kind or verdict, or one that does not fit the others.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8")).get("file", [])
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: expected TOML, found {error}") from None
    files = [_file(path, table) for table in tables]
    names = [file.name for file in files]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ConfigError(f"{path}: {twice[0]!r} stands for two files; give each a name of its own")
    return files


def dump(files: Iterable[File], path: Path = MANIFEST) -> None:
    """Write a manifest: the first half by kind and name, then the second."""
    ordered = sorted(files, key=lambda file: (file.half, KINDS.index(file.kind), file.name))
    halves = ["\n".join(_table(file) for file in ordered if file.half == half) for half in (1, 2)]
    path.write_text(
        f"{_HEAD}\n{halves[0]}{_SECOND if halves[1] else ''}\n{halves[1]}".rstrip() + "\n", encoding="utf-8"
    )


def _file(path: Path, table: Any) -> File:
    name = table.get("name", table) if isinstance(table, dict) else table
    try:
        file = msgspec.convert(table, File)
    except msgspec.ValidationError as error:
        raise ConfigError(f"{path}: file {name!r}: {error}") from None
    if file.kind not in KINDS:
        raise ConfigError(f"{path}: file {name!r}: kind {file.kind!r}: expected one of {', '.join(KINDS)}")
    fitting = WITH_INTERIOR if file.interior else WITHOUT_INTERIOR
    if file.verdict and file.verdict not in fitting:
        expected = ", ".join(fitting)
        raise ConfigError(f"{path}: file {name!r}: verdict {file.verdict!r}: expected one of {expected}")
    return file


def _table(file: File) -> str:
    """Write a file as a TOML table; strings of JSON are strings of TOML."""
    values = msgspec.to_builtins(file)
    return "[[file]]\n" + "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items())
