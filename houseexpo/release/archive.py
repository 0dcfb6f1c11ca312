"""Write the JSON of all plans as one reproducible ``.tar.gz``: sorted, with time 0 and without an owner."""

from __future__ import annotations

import gzip
import io
import tarfile
from collections.abc import Iterable
from pathlib import Path
from typing import Final

_LEVEL: Final = 6


def write_archive(file: Path, members: Iterable[tuple[str, bytes]]) -> None:
    """Write members (name, content) in the given order."""
    with (
        file.open("wb") as raw,
        gzip.GzipFile(filename="", mode="wb", compresslevel=_LEVEL, fileobj=raw, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w|", format=tarfile.PAX_FORMAT) as archive,
    ):
        for name, content in members:
            member = tarfile.TarInfo(name)
            member.size, member.mode = len(content), 0o644
            archive.addfile(member, io.BytesIO(content))
