"""Write the folder of a release atomically; it replaces nothing but a former release.

R1  The folder must be missing or empty, or contain a former release and nothing else.
R2  Everything is first written to a folder beside it, which replaces it at the end.
R3  ``SHA256SUMS`` lists every other file with its hash, sorted; ``sha256sum --check SHA256SUMS`` verifies them.
"""

from __future__ import annotations

import gzip
import io
import shutil
import tarfile
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from houseexpo.errors import ConfigError
from houseexpo.files import PARTIAL, sha256_of, write_atomically

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
