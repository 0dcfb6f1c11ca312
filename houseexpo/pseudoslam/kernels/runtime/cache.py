"""Kernels on disk that no longer say what the sources do are compiled anew, and nothing is deleted for it.

numba keeps what it has compiled beside a stamp of the file that it stands in, and does not look at other files that it
calls: after an update of one of those it would go on with the old code. The stamp here is a hash of all files of the
package, so that an index of another stamp counts as empty, and is written over when something is compiled.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import caching


@cache
def digest_of(sources: Path) -> str:
    """Return a hash of the Python files of a folder and of those below it."""
    found = hashlib.sha256()
    for source in sorted(sources.rglob("*.py")):
        found.update(source.relative_to(sources).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return found.hexdigest()


def stamp_with_all_sources(sources: Path) -> None:
    """Give kernels below a folder, made from now on, a stamp that every one of its files is part of."""
    places: list[Any] = caching.CacheImpl._locator_classes  # noqa: SLF001  # numba offers no other way in code
    plain = [place for place in places if getattr(place, "sources", None) != sources]
    files = (caching.UserProvidedCacheLocator, caching.InTreeCacheLocator, caching.UserWideCacheLocator)
    places[:] = [*(_stamped(place, sources) for place in files), *plain]


def _stamped(place: Any, folder: Path) -> Any:
    """Return a way of finding a kernel's place on disk as ``place`` does, for files of the folder only."""

    class Stamped(place):  # type: ignore[misc]  # numba comes without types
        sources = folder

        def get_source_stamp(self) -> str:
            return digest_of(folder)

        @classmethod
        def from_function(cls, py_func: Any, py_file: str) -> Any:
            return super().from_function(py_func, py_file) if folder in Path(py_file).parents else None

    return Stamped
