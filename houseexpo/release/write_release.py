"""Release a data set: check it, split it, and write tables, archive and descriptions to a folder atomically."""

from __future__ import annotations

import gzip
import io
import os
import re
import shutil
import tarfile
import tempfile
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Final

import msgspec

from houseexpo.analysis.audit import audit_plan
from houseexpo.dataset.splits import encode_id_list
from houseexpo.dataset.store import files_at
from houseexpo.dataset.store.folders import ARCHIVE
from houseexpo.drawing import draw_plan
from houseexpo.errors import ConfigError
from houseexpo.exports.encoding import encode_image
from houseexpo.files import PARTIAL, encode_json, named_path, sha256_of, write_atomically
from houseexpo.floorplan import decode
from houseexpo.outputs import check_not_in_inputs
from houseexpo.processes import map_in_processes
from houseexpo.progress import show_progress
from houseexpo.release.check_releasable import Licence, PublisherTexts, ReleasableDataset, check_releasable
from houseexpo.release.croissant import describe_in_croissant
from houseexpo.release.data_card import MEASURES, SHEET, draw_measures_png, draw_sheet_png, make_data_card
from houseexpo.release.descriptions import ReleaseFacts, citation_files
from houseexpo.release.splits import ReleaseSplits, release_splits
from houseexpo.release.tables import OBJECTS, TABLES, WINDOWS, ReleasePlan, ReleaseTable, Row, TableWriter

PICTURE_PX: Final = 256
_IDS_PER_PART: Final = 32


@dataclass(frozen=True)
class FinishedRelease:
    """A finished release: its folder, its licence, the number of rows of each part of each table, and its size."""

    folder: Path
    licence: Licence
    rows: Mapping[str, Mapping[str, int]]
    size: int


def release(dataset: str | os.PathLike[str], out: str | os.PathLike[str], about: PublisherTexts | None = None, *,
            workers: int = 1) -> FinishedRelease:  # fmt: skip
    """Write a release of a data set: a folder that is ready to upload.

    Parameters
    ----------
    dataset
        A data set folder that ``houseexpo build`` finished.
    out
        The output folder: new, empty, or a former release, which is replaced.
    about
        Title, creators, version, date, addresses.
    workers
        Number of processes; it does not change the output. With more than one, a script needs
        ``if __name__ == "__main__"``.

    Raises
    ------
    ConfigError
        ``out`` lies in the data set, or holds other files.
    DatasetError
        The data set is unfinished, damaged or empty, its plans may not be redistributed, or its lists divide a house.
    """
    target = named_path(out, "release: out")
    check_target(target)
    check_not_in_inputs(target, [Path(dataset)])
    with check_releasable(files_at(dataset, "release")) as found, atomic_release_folder(target) as folder:
        parts = release_splits(found.plans, workers)
        empty = [*([] if _has_furniture(found) else [OBJECTS]), *([] if _has_windows(found) else [WINDOWS])]
        tables = tuple(table for table in TABLES if table not in empty)
        rows = _write_tables(folder, tables, found, parts, workers)
        facts = ReleaseFacts(_slug(target), about or PublisherTexts(), found, parts, rows)
        _write_files(folder, tables, facts)
        size = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    return FinishedRelease(target, found.licence, rows, size)


def _write_tables(
    folder: Path, tables: tuple[ReleaseTable, ...], found: ReleasableDataset, parts: ReleaseSplits, workers: int
) -> dict[str, dict[str, int]]:
    """Write a file for each table and part; return the number of rows of each."""
    rows: defaultdict[str, dict[str, int]] = defaultdict(dict)
    for table in tables:
        (folder / table.name).mkdir()
    chunks = list(_chunks(parts))
    plans = ((part, [(found.plans.raw(name), parts.group_of[name]) for name in ids]) for part, ids in chunks)
    made = map(_rows_of, plans) if workers <= 1 else map_in_processes(_rows_of, plans, workers)
    for part, answers in groupby(show_progress(made, "writing tables", len(chunks)), key=itemgetter(0)):
        with ExitStack() as files:
            writers = {
                table.name: files.enter_context(TableWriter(folder / table.name / f"{part}.parquet", table))
                for table in tables
            }
            for _, made_rows in answers:
                for name, writer in writers.items():
                    writer.add(made_rows[name])
        for name, writer in writers.items():
            rows[name][part] = writer.rows
    return dict(rows)


def _chunks(parts: ReleaseSplits) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield ids with their part, a few at a time."""
    for part, ids in parts.lists.items():
        for start in range(0, len(ids), _IDS_PER_PART):
            yield part, ids[start : start + _IDS_PER_PART]


def _rows_of(chunk: tuple[str, list[tuple[bytes, str]]]) -> tuple[str, dict[str, list[Row]]]:
    """Return the rows of some plans of a part, by table; this runs in a worker."""
    part, plans = chunk
    rows: dict[str, list[Row]] = {table.name: [] for table in TABLES}
    for data, group in plans:
        plan = decode(data)
        placed = ReleasePlan(plan, part, group, encode_image(draw_plan(plan, size=PICTURE_PX), "PNG"), audit_plan(plan))
        for table in TABLES:
            rows[table.name] += table.rows(placed)
    return part, rows


def _write_files(folder: Path, tables: tuple[ReleaseTable, ...], facts: ReleaseFacts) -> None:
    """Write all files other than the tables, the checksums last."""
    plans, manifest = facts.material.plans, facts.material.manifest
    write_archive(folder / ARCHIVE, ((f"json/{name}.json", plans.raw(name)) for name in plans.ids))
    for home in ("splits", "pictures"):
        (folder / home).mkdir()
    for part, ids in facts.parts.lists.items():
        write_atomically(folder / "splits" / f"{part}.txt", encode_id_list(ids))
    provenance = msgspec.to_builtins(manifest)
    del provenance["files"]
    written = {
        SHEET: draw_sheet_png(plans),
        MEASURES: draw_measures_png(facts.stats),
        "README.md": make_data_card(facts, tables),
        "stats.json": encode_json(facts.material.stats),
        "provenance.json": encode_json(provenance),
        **citation_files(facts),
    }
    for name, data in written.items():
        write_atomically(folder / name, data)
    write_atomically(folder / CROISSANT, encode_json(describe_in_croissant(facts, tables, folder)))
    write_checksums(folder)


def _has_furniture(found: ReleasableDataset) -> bool:
    """Return whether any plan has furniture, according to the statistics."""
    return bool(found.stats["plans"].get("furniture", {}).get("count"))


def _has_windows(found: ReleasableDataset) -> bool:
    """Return whether any plan has windows."""
    return any(b'"windows":[' in found.plans.raw(name) for name in found.plans.ids)


def _slug(target: Path) -> str:
    """Return the folder's name in a form that is valid in descriptions."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", target.absolute().name).strip("-.") or "houseexpo-release"


# Write the folder of a release atomically; it replaces nothing but a former release.
#
# R1  The folder must be missing or empty, or contain a former release and nothing else.
# R2  Everything is first written to a folder beside it, which replaces it at the end.
# R3  ``SHA256SUMS`` lists every other file with its hash, sorted; ``sha256sum --check SHA256SUMS`` verifies them.


SUMS: Final = "SHA256SUMS"
CROISSANT: Final = "croissant.json"


def check_target(target: Path) -> None:
    """Raise ConfigError if a release must not be written to this folder (R1)."""
    if target.is_symlink() or (target.exists() and not target.is_dir()):
        what = "a link" if target.is_symlink() else "a file"
        raise ConfigError(f"{target}: expected a folder or nothing, found {what}; choose another --out")
    if not target.exists() or not any(target.iterdir()):
        return
    if not (target / SUMS).is_file() or not (target / CROISSANT).is_file():
        raise ConfigError(
            f"{target}: expected an empty folder or a former release, found other files; choose another --out"
        )
    known = {SUMS, *_names_in_sums(target / SUMS)}
    others = sorted(set(_files(target)) - known)
    if others:
        raise ConfigError(
            f"{target}: holds {others[0]!r}{f' and {len(others) - 1} more' if len(others) > 1 else ''} beside a former "
            "release, which would be removed with it; move it away, or choose another --out"
        )


@contextmanager
def atomic_release_folder(target: Path) -> Iterator[Path]:
    """Yield a folder beside the target; at the end it replaces the target, or is removed after an error (R2)."""
    target = target.absolute()
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = Path(tempfile.mkdtemp(dir=target.parent, prefix=PARTIAL))
    try:
        new, old = partial / "new", partial / "old"
        new.mkdir()
        yield new
        check_target(target)  # again, since the folder may have changed meanwhile
        if target.exists():
            target.rename(old)
        try:
            new.rename(target)
        except OSError:
            if old.exists():
                old.rename(target)
            raise
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def write_checksums(folder: Path) -> None:
    """Write ``SHA256SUMS`` (R3)."""
    lines = [f"{sha256_of(folder / name)}  {name}\n" for name in _files(folder) if name != SUMS]
    write_atomically(folder / SUMS, "".join(lines).encode())


def _files(folder: Path) -> list[str]:
    """Return the names of all files and links below a folder, sorted."""
    found = (file for file in folder.rglob("*") if file.is_symlink() or not file.is_dir())
    return sorted(file.relative_to(folder).as_posix() for file in found)


def _names_in_sums(sums: Path) -> Iterator[str]:
    for line in sums.read_text(encoding="utf-8", errors="replace").splitlines():
        yield line.partition("  ")[2]


_GZIP_LEVEL: Final = 6


def write_archive(file: Path, members: Iterable[tuple[str, bytes]]) -> None:
    """Write members (name, content) in the given order."""
    with (
        file.open("wb") as raw,
        gzip.GzipFile(filename="", mode="wb", compresslevel=_GZIP_LEVEL, fileobj=raw, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w|", format=tarfile.PAX_FORMAT) as archive,
    ):
        for name, content in members:
            member = tarfile.TarInfo(name)
            member.size, member.mode = len(content), 0o644
            archive.addfile(member, io.BytesIO(content))
