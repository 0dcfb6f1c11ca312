"""Check a data set's files and stored plans against the hashes that its build wrote; yield a line for each fault."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import msgspec

from houseexpo.errors import ConfigError
from houseexpo.files import is_device, read_json, sha256_of
from pipeline.batch.data_set_folder import MANIFEST, PARTS, DataSetFolder, DataSetManifest
from pipeline.batch.disk import printable
from pipeline.batch.journal import Journal
from pipeline.batch.plan_store import DamagedPlanError, PlanStore
from pipeline.batch.result_store import FolderStore


def find_damaged_files(root: Path) -> Iterator[str]:
    """Yield what is wrong with a data set, a line for each file; nothing is changed but damaged plans in the store.

    Raises
    ------
    ConfigError
        Where there is no data set, or its build has not ended.
    """
    try:
        files = read_json(root / MANIFEST, DataSetManifest).files
    except OSError:
        raise ConfigError(f"{root}: expected a data set, found no {MANIFEST}; build it first") from None
    except msgspec.DecodeError:
        yield f"{MANIFEST}: damaged"
        return
    for name, sha256 in files.items():
        try:
            if is_device(root / name):
                raise FileNotFoundError(name)
            found = sha256_of(root / name)
        except OSError:
            yield f"{name}: missing"
            continue
        if found != sha256:
            yield f"{name}: changed since it was written"
    for part in PARTS:
        for file in sorted((root / part).glob("*")):
            if f"{part}/{file.name}" not in files:
                yield f"{part}/{printable(file.name)}: no build wrote it"
    yield from _store(DataSetFolder(root))


def _store(folder: DataSetFolder) -> Iterator[str]:
    """Yield the damaged plans of the store; a data set without its store is sound."""
    if not (folder.build / "journal.jsonl").is_file():
        return
    plans = PlanStore(FolderStore(folder.root))
    with contextlib.closing(Journal(folder.build / "journal.jsonl")) as journal:
        for entry in journal.current():
            for kept in entry.plans:
                try:
                    plans.get(kept)
                    plans.picture(kept)
                except DamagedPlanError:
                    yield f".build/plans: {kept.id}: damaged; the next build makes it again"
