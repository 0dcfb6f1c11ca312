"""Check that a data set may be released: a complete, unchanged build whose plans may be redistributed.

The texts that the publisher provides are checked too: title, creators, version, date and addresses.

R1  It is a folder that ``houseexpo build`` finished, with at least one plan and all inputs done. No build is running.
R2  Every file has the SHA-256 that the manifest states.
R3  Houses that the project generates (``procedural:``) may be redistributed under ``OWN``, or under the licence
    that their manifest states. For all others, the manifest must state a licence.
R4  The credit (``credit``) is one line, like the publisher's own texts, since it is part of every description.
R5  Published HouseExpo plans are not redistributed; ``houseexpo fetch`` downloads them. Nor are plans of SUNCG, which
    was withdrawn.
"""

from __future__ import annotations

import difflib
import fcntl
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Final

import msgspec

from houseexpo.dataset import Dataset, open_dataset
from houseexpo.dataset.store.catalogue import require_finished
from houseexpo.dataset.store.stored_plans import read_stored_plans
from houseexpo.errors import ConfigError, DatasetError
from houseexpo.files import read_json, real_path, sha256_of
from houseexpo.progress import show_progress

CREATORS: Final = ("HouseExpo contributors",)
_LINE_LETTERS: Final = 300
LINE: Final = f"a line of at most {_LINE_LETTERS} letters"


@dataclass(frozen=True)
class PublisherTexts:
    """Texts for the descriptions of a release; empty ones are left out.

    ``published`` is a date (2026-05-01). The current time is not used, so that two releases of the same data set to
    folders of the same name have equal bytes.

    Raises
    ------
    ConfigError
        A text is not valid in its place.
    """

    title: str = ""
    creators: tuple[str, ...] = CREATORS
    version: str = "1.0.0"
    published: str = ""
    url: str = ""
    doi: str = ""

    def __post_init__(self) -> None:
        for name, text in (("title", self.title), *(("creator", creator) for creator in self.creators)):
            if not fits_one_line(text):
                raise ConfigError(f"release: {name}: expected {LINE}, found {text!r}")
        if not self.creators or not all(self.creators):
            raise ConfigError("release: creator: expected at least one name, found none")
        _match(self.version, r"\d+\.\d+\.\d+", "version", "three numbers such as 1.0.0")
        _match(self.url, r"(https?://[^\s\"<>]+)?", "url", "an address that begins with https://")
        _match(self.doi, r"(10\.\d{4,9}/[^\s\"<>]+)?", "doi", "a DOI such as 10.5281/zenodo.1234567")
        if self.published:
            try:
                date.fromisoformat(self.published)
            except ValueError:
                expected = "a date such as 2026-05-01"
                raise ConfigError(f"release: date: expected {expected}, found {self.published!r}") from None
            _match(self.published, r"\d{4}-\d\d-\d\d", "date", "a date such as 2026-05-01")

    @property
    def year(self) -> str:
        """The year of publication, "" if no date is given."""
        return self.published[:4]


def fits_one_line(text: str) -> bool:
    """Return whether a text fits in one line of a description: printable, not too long, no space at the ends."""
    return len(text) <= _LINE_LETTERS and text.isprintable() and text == text.strip()


def _match(text: str, pattern: str, name: str, expected: str) -> None:
    if not re.fullmatch(pattern, text):
        raise ConfigError(f"release: {name}: expected {expected}, found {text!r}")


@dataclass(frozen=True)
class Licence:
    """A licence: its SPDX identifier, its name, its address, and its name at Hugging Face."""

    spdx: str
    title: str
    url: str
    hub: str


_CC: Final = "https://creativecommons.org"
_ODC: Final = "https://opendatacommons.org/licenses"

LICENCES: Final = {
    licence.spdx: licence
    for licence in (
        Licence("CC0-1.0", "Creative Commons Zero 1.0", f"{_CC}/publicdomain/zero/1.0/", "cc0-1.0"),
        Licence("CC-BY-4.0", "Creative Commons Attribution 4.0", f"{_CC}/licenses/by/4.0/", "cc-by-4.0"),
        Licence(
            *("CC-BY-SA-4.0", "Creative Commons Attribution Share Alike 4.0"),
            *(f"{_CC}/licenses/by-sa/4.0/", "cc-by-sa-4.0"),
        ),
        Licence(
            *("CC-BY-NC-4.0", "Creative Commons Attribution Non Commercial 4.0"),
            *(f"{_CC}/licenses/by-nc/4.0/", "cc-by-nc-4.0"),
        ),
        Licence(
            *("CC-BY-NC-SA-4.0", "Creative Commons Attribution Non Commercial Share Alike 4.0"),
            *(f"{_CC}/licenses/by-nc-sa/4.0/", "cc-by-nc-sa-4.0"),
        ),
        Licence("PDDL-1.0", "Public Domain Dedication and License 1.0", f"{_ODC}/pddl/1-0/", "pddl"),
        Licence("ODC-By-1.0", "Open Data Commons Attribution 1.0", f"{_ODC}/by/1-0/", "odc-by"),
        Licence("ODbL-1.0", "Open Database License 1.0", f"{_ODC}/odbl/1-0/", "odbl"),
        Licence(
            *("CDLA-Permissive-2.0", "Community Data License Agreement Permissive 2.0"),
            *("https://cdla.dev/permissive-2-0/", "cdla-permissive-2.0"),
        ),
        Licence("MIT", "MIT License", "https://opensource.org/license/mit", "mit"),
        Licence("Apache-2.0", "Apache License 2.0", "https://www.apache.org/licenses/LICENSE-2.0", "apache-2.0"),
    )
}

OWN: Final = "CC-BY-4.0"
"""The licence of houses that the project generates, unless the manifest states another."""


def find_licence(spdx: str, what: str) -> Licence:
    """Return the licence with an identifier in any letter case; raise DatasetError if it is not in the list."""
    by_lower = {name.lower(): licence for name, licence in LICENCES.items()}
    found = by_lower.get(spdx.lower())
    if found is None:
        near = difflib.get_close_matches(spdx, LICENCES, n=1, cutoff=0.0)[0]
        raise DatasetError(
            f"{what}: expected a licence under which plans may be passed on, by its SPDX identifier; found {spdx!r}; "
            f"the nearest is {near!r}, known are {', '.join(LICENCES)}"
        )
    return found


MADE: Final = "procedural:"
_WITHDRAWN: Final = "suncg"


class BuildManifest(msgspec.Struct, frozen=True):
    """The parts of ``manifest.json`` that a release repeats or depends on."""

    sources: list[str]
    counts: dict[str, Any]
    files: dict[str, str]
    format: str
    generator: dict[str, str] = {}
    parameters: dict[str, Any] = {}
    parameters_sha256: str = ""
    versions: dict[str, str] = {}
    licence: str = ""
    credit: str = ""

    @property
    def is_made(self) -> bool:
        """Whether the project generated all of the houses."""
        return bool(self.sources) and all(source.startswith(MADE) for source in self.sources)


@dataclass(frozen=True)
class ReleasableDataset:
    """A data set that may be released, and its licence; ``stats`` is its ``stats.json``."""

    plans: Dataset
    manifest: BuildManifest
    licence: Licence
    stats: Mapping[str, Any]


@contextmanager
def check_releasable(path: Path) -> Iterator[ReleasableDataset]:
    """Open a data set that may be released, and lock it against builds while the context is active.

    Raises
    ------
    DatasetError
        The data set may not be released, or not yet; the message says why, and what to do.
    """
    file = path / "manifest.json"
    if not file.is_file():
        raise _no_build(path)
    with _lock_for_reading(path):
        manifest = _manifest(file)
        licence = _licence(path, manifest)
        _check_credit(path, manifest)
        plans = open_dataset(path)
        _check_whole(path, manifest, plans)
        _check_withdrawn(path, manifest, plans)
        stats = read_json(path / "stats.json", dict[str, Any])
        yield ReleasableDataset(plans, manifest, licence, stats)


def _no_build(path: Path) -> DatasetError:
    """Return the error for something that is not a finished build (R1, R5)."""
    require_finished(path)
    first = next((record for record in read_stored_plans(path) if not record.fault), None)
    if first is not None and b'"format"' not in first.data:
        return DatasetError(
            f"{path}: published HouseExpo plans are not passed on from here, because whoever wants them gets them from "
            "their authors by houseexpo fetch; build a data set of houses of your own, or of procedural:COUNT"
        )
    return DatasetError(
        f"{path}: expected a data set folder that houseexpo build wrote, with its manifest.json, found none; "
        "only a manifest says where plans come from"
    )


@contextmanager
def _lock_for_reading(path: Path) -> Iterator[None]:
    """Hold the builds' lock, shared with other readers (R1); no build writes to a data set without ``.build``."""
    lock = path / ".build" / "lock"
    if not lock.is_file():
        yield
        return
    descriptor = os.open(lock, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DatasetError(f"{path}: a build is at work in it; wait until it has ended") from None
        except OSError:  # a file system without locks: the user has to take care
            pass
        yield
    finally:
        os.close(descriptor)


def _manifest(file: Path) -> BuildManifest:
    try:
        return read_json(file, BuildManifest)
    except (msgspec.DecodeError, OSError) as error:
        raise DatasetError(f"{file}: expected the manifest of a data set, found {error}; build again") from None


def _licence(path: Path, manifest: BuildManifest) -> Licence:
    """Return the licence of the plans (R3)."""
    if manifest.licence:
        return find_licence(manifest.licence, f"{path / 'manifest.json'}: licence")
    if manifest.is_made:
        return find_licence(OWN, "release")
    others = [source for source in manifest.sources if not source.startswith(MADE)] or ["unknown"]
    named = ", ".join(map(repr, others[:3])) + (f" and {len(others) - 3} more" if len(others) > 3 else "")
    raise DatasetError(
        f"{path}: the plans come from {named}, and nothing states one licence for all of them; where you may pass them "
        'on, write licence = "CC-BY-4.0" (its SPDX identifier) under [build] in the manifest of each and build again'
    )


def _check_credit(path: Path, manifest: BuildManifest) -> None:
    """Raise DatasetError if the credit is not one line (R4)."""
    if not fits_one_line(manifest.credit):
        raise DatasetError(
            f"{path}: manifest.json: credit: expected {LINE}, found {manifest.credit!r}; write it so under [build] and "
            "build again"
        )


def _check_whole(path: Path, manifest: BuildManifest, plans: Dataset) -> None:
    """Raise DatasetError if a file is missing or changed (R1, R2)."""
    if not len(plans):
        raise DatasetError(f"{path}: expected plans, found none; see rejected.jsonl for the reasons")
    if waiting := manifest.counts.get("not_done", 0):
        raise DatasetError(
            f"{path}: expected a finished build, found {waiting} inputs not done; run houseexpo build again"
        )
    needed = ("index.parquet", "stats.json", *(f"json/{name}.json" for name in plans.ids))
    if missing := [name for name in needed if name not in manifest.files]:
        raise DatasetError(f"{path}: {missing[0]}: expected in the manifest, not found in it; build again")
    for name, expected in show_progress(manifest.files.items(), f"checking {path.name}", len(manifest.files)):
        if not _lies_below(path, name):
            raise DatasetError(f"{path}: manifest.json: expected names of files in the folder, found {name!r}")
        try:
            found = sha256_of(path / name)
        except OSError as error:
            raise DatasetError(f"{path}: {name}: cannot be read ({error.strerror}); build again") from None
        if found != expected:
            raise DatasetError(
                f"{path}: {name}: expected the SHA-256 that the manifest gives, found another; "
                "the file was changed or is damaged: build again"
            )


def _lies_below(path: Path, name: str) -> bool:
    return real_path(path) in real_path(path / name).parents


def _check_withdrawn(path: Path, manifest: BuildManifest, plans: Dataset) -> None:
    """Raise DatasetError for SUNCG (R5), by the sources, since its reader also reads generated houses."""
    if manifest.is_made:
        return
    withdrawn = plans.column("source").count(_WITHDRAWN)
    if withdrawn:
        raise DatasetError(
            f"{path}: {withdrawn} of its plans were made from SUNCG's houses, which were withdrawn and may not be "
            "passed on; build without them"
        )
