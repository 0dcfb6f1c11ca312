"""numba's cache on disk where it can fail: nowhere to write, files that were cut off, and sources that changed.

R1  Where neither the package's folder nor the user's cache can be written, kernels are compiled in each process anew,
    with one warning: numba alone refuses to import them.
R2  A file of the cache that cannot be read counts as empty, and is written over: numba alone ends with pickle's error.
R3  What was compiled from other sources is compiled anew. numba keeps it beside a stamp of the file that it stands in,
    and does not look at other files that it calls. The stamp here is a hash of all files of the package. An index of
    another stamp counts as empty, and is written over; nothing is deleted.
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

caching: Any = numba_caching  # some of it is typed, some is not


def cache_safely(package: Path) -> None:
    """Let what is compiled from files below ``package`` hold to R1 to R3; to be called before a kernel is made."""
    if not issubclass(caching.IndexDataCacheFile, _Healing):
        caching.IndexDataCacheFile = _Healing
    places: list[Any] = caching.CacheImpl._locator_classes  # noqa: SLF001  # numba offers no other way in code
    if not any(getattr(place, "package", None) == package for place in places):
        files = (caching.UserProvidedCacheLocator, caching.InTreeCacheLocator, caching.UserWideCacheLocator)
        places[:] = [*(_stamped(place, package) for place in files), *places, _last_resort(package)]


@cache
def digest_of(package: Path) -> str:
    """Return a hash of the Python files of a folder and of those below it."""
    found = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        found.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes() + b"\0")
    return found.hexdigest()


def is_missing(kernel: Any) -> bool:
    """Whether a kernel is to be kept on disk, where other processes find it, and is not there yet."""
    kept = kernel._cache  # noqa: SLF001  # numba offers no other way to ask
    return not isinstance(kept._impl.locator, _OfThisProcess) and kept._cache_file.is_empty()  # noqa: SLF001


class _Healing(caching.IndexDataCacheFile):  # type: ignore[misc]
    """An index of compiled kernels that counts as empty where it cannot be read (R2)."""

    def load(self, key: Any) -> Any:
        try:
            return super().load(key)
        except OSError:
            raise
        except Exception:  # noqa: BLE001  # pickle raises anything on damaged bytes
            self.flush()
            return None

    def is_empty(self) -> bool:
        """Whether nothing is kept there that can be read and was compiled from these sources."""
        try:
            return not self._load_index()
        except Exception:  # noqa: BLE001
            return True

    def save(self, key: Any, data: Any) -> None:
        try:
            super().save(key, data)
        except OSError:
            raise
        except Exception:  # noqa: BLE001
            self.flush()
            super().save(key, data)


def _stamped(place: Any, folder: Path) -> Any:
    """Return a way of finding a kernel's place on disk as ``place`` does, for files of the folder only (R3)."""

    class Stamped(place):  # type: ignore[misc]
        package = folder

        def get_source_stamp(self) -> str:
            return digest_of(folder)

        @classmethod
        def from_function(cls, py_func: Any, py_file: str) -> Any:
            return super().from_function(py_func, py_file) if folder in Path(py_file).parents else None

    return Stamped


class _OfThisProcess:
    """Where kernels are kept that no other process finds."""


def _last_resort(folder: Path) -> Any:
    """Return a place for kernels that numba takes where no other will do: a folder of this process (R1)."""

    class LastResort(_OfThisProcess, _stamped(caching.UserWideCacheLocator, folder)):  # type: ignore[misc]
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
