"""Make numba's cache on disk robust against folders without write access, truncated files and changed sources.

R1  If neither the package's folder nor the user's cache is writable, each process compiles the kernels anew, with one
    warning. numba alone would refuse to import them.
R2  A cache file that cannot be read counts as empty and is overwritten. numba alone would fail with pickle's error.
R3  Kernels that were compiled from other sources are compiled again. numba's own stamp covers only the file that
    defines the kernel, not the other files that it calls. The stamp here is a hash of all files of the package. An
    index with another stamp counts as empty and is overwritten; nothing is deleted.
"""

from __future__ import annotations

import atexit
import hashlib
import shutil
import tempfile
import warnings
from functools import cache
from pathlib import Path
from typing import Any

from numba.core import caching as numba_caching

caching: Any = numba_caching  # only some of it is typed


def make_cache_robust(package: Path) -> None:
    """Apply R1 to R3 to kernels in files below ``package``; call this before the first kernel is defined."""
    if not issubclass(caching.IndexDataCacheFile, _Healing):
        caching.IndexDataCacheFile = _Healing
    places: list[Any] = caching.CacheImpl._locator_classes  # noqa: SLF001  # numba offers no other way in code
    if not any(getattr(place, "package", None) == package for place in places):
        files = (caching.UserProvidedCacheLocator, caching.InTreeCacheLocator, caching.UserWideCacheLocator)
        places[:] = [*(_locator_for_folder(place, package) for place in files), *places, _last_resort(package)]


@cache
def hash_package(package: Path) -> str:
    """Return a hash of all Python files in a folder and its subfolders."""
    found = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        found.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return found.hexdigest()


class _Healing(caching.IndexDataCacheFile):  # type: ignore[misc]
    """An index of compiled kernels that counts as empty if it cannot be read (R2)."""

    def load(self, key: Any) -> Any:
        try:
            return super().load(key)
        except OSError:
            raise
        except Exception:  # noqa: BLE001  # pickle raises anything on damaged bytes
            self.flush()
            return None

    def save(self, key: Any, data: Any) -> None:
        try:
            super().save(key, data)
        except OSError:
            raise
        except Exception:  # noqa: BLE001
            self.flush()
            super().save(key, data)


def _locator_for_folder(place: Any, folder: Path) -> Any:
    """Return a cache locator like ``place``, but only for files of the folder (R3)."""

    class Stamped(place):  # type: ignore[misc]
        package = folder

        def get_source_stamp(self) -> str:
            return hash_package(folder)

        @classmethod
        def from_function(cls, py_func: Any, py_file: str) -> Any:
            return super().from_function(py_func, py_file) if folder in Path(py_file).parents else None

    return Stamped


def _last_resort(folder: Path) -> Any:
    """Return the cache locator that numba uses if all others fail: a folder of this process (R1)."""

    class LastResort(_locator_for_folder(caching.UserWideCacheLocator, folder)):  # type: ignore[misc]
        def __init__(self, py_func: Any, py_file: str) -> None:
            super().__init__(py_func, py_file)
            self._cache_path = _folder_of_this_process()

    return LastResort


@cache
def _folder_of_this_process() -> str:
    folder = tempfile.mkdtemp(prefix="houseexpo-kernels-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    warnings.warn(
        "compiled kernels cannot be kept: neither the package's folder nor the user's cache can be written. "
        "Each process compiles them anew, which takes seconds; NUMBA_CACHE_DIR names a folder for them",
        stacklevel=2,
    )
    return folder
