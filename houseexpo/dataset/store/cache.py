"""The user's cache folder: data sets that were read before are found by path, size and time, or by their hash."""

from __future__ import annotations

import hashlib
import os
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

from houseexpo.dataset.store.folders import look, plan_files, plan_folder, plan_stamp
from houseexpo.dataset.store.records import broken
from houseexpo.files import PARTIAL, cache_folder, whole_folder, write_whole

VERSION: Final = "2"
"""Part of every key, so that files in another layout are not read."""

_LEFT_S: Final = 3600.0


def stored(path: Path, build: Callable[[Path], None], is_whole: Callable[[Path], bool]) -> Path:
    """Return the folder with the result of ``build`` for a data set, and call ``build`` if there is none yet.

    1. Path, size and time of a file (for a folder, of every plan in it) lead to the hash of its content.
    2. The hash leads to the result, so that a copied or touched file is not built again.
    3. ``build`` fills a temporary folder, which is renamed when it is complete.
    4. A damaged result (``is_whole``) is built again. Remains of killed processes are deleted.
    """
    key = cache_folder("keys", VERSION) / _stamp(path)
    stores = cache_folder("stores", VERSION)
    if key.exists():  # R1
        known = stores / key.read_text(errors="replace")
        if known.parent == stores and is_whole(known):
            return known
    store = stores / _content(path)
    if not is_whole(store):  # R2, R4
        _sweep(stores)
        _sweep(key.parent)
        shutil.rmtree(store, ignore_errors=True)
        with whole_folder(store) as partial:  # R3
            build(partial)
    write_whole(key, store.name.encode())
    return store


def _stamp(path: Path) -> str:
    digest = hashlib.sha256(os.fsencode(path.resolve()))
    if path.is_dir():
        digest.update(plan_stamp(plan_folder(path)).encode())
    else:
        digest.update(repr(look(path.stat())).encode())
    return digest.hexdigest()


def _content(path: Path) -> str:
    digest = hashlib.sha256()
    with broken(path):
        if path.is_dir():
            folder = plan_folder(path)
            for name in plan_files(folder):
                digest.update(name.encode() + b"\0" + hashlib.sha256((folder / name).read_bytes()).digest())
        else:
            with path.open("rb") as stream:
                digest.update(hashlib.file_digest(stream, "sha256").digest())
            digest.update(path.name.rpartition(".")[2].encode())
    return digest.hexdigest()


def _sweep(folder: Path) -> None:
    """Remove folders that were started and not changed for an hour, since their process was killed."""
    for partial in folder.glob(f"{PARTIAL}*"):
        with suppress(OSError):
            latest = max(entry.stat().st_mtime for entry in (partial, *partial.rglob("*")))
            if time.time() - latest > _LEFT_S:
                shutil.rmtree(partial) if partial.is_dir() else partial.unlink()
