"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from houseexpo.errors import ConfigError


def write_whole(file: Path, data: bytes) -> None:
    """Write a file whole or not at all.

    Raises
    ------
    ConfigError
        What is there is no regular file but a device, a pipe or a folder.
    """
    if file.exists() and not file.is_file():
        what = "a folder" if file.is_dir() else "a device or a pipe"
        raise ConfigError(f"{file}: expected a regular file or a new one, found {what}; name another")
    descriptor, partial = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name[:100]}.")
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
        Path(partial).chmod(0o644)
        Path(partial).replace(file)
    except BaseException:
        Path(partial).unlink(missing_ok=True)
        raise
