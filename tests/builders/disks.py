"""Disks of a size, to fill up."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

Disk = Callable[[str, str], Path]


def mount(options: str, place: Path) -> None:
    command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("no tmpfs can be mounted here: that takes root")


@contextmanager
def disks() -> Iterator[Disk]:
    """Yield what mounts a disk of a size, under a name; mounting it again gives it another size.

    Its path is short: sockets of worker processes lie in the temporary folder, and their names have a limit.
    """
    home = Path(tempfile.mkdtemp(prefix="disk-"))
    mounted: list[Path] = []

    def sized(name: str, size: str) -> Path:
        place = home / name
        again = place in mounted
        place.mkdir(exist_ok=True)
        mount(f"{'remount,' if again else ''}size={size}", place)
        mounted.extend([] if again else [place])
        return place

    yield sized
    for place in mounted:
        subprocess.run(["umount", "-l", str(place)], check=False)
    shutil.rmtree(home, ignore_errors=True)
