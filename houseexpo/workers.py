"""Worker processes that compute with one thread each: more of them, on as many cores, only get in each other's way."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

THREADS: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""Libraries read these when they are loaded."""


def cores(groups: Path = Path("/proc/self/cgroup"), mount: Path = Path("/sys/fs/cgroup")) -> int:
    """Return how many cores this process may use: by its affinity, and by the quota of its control groups (Linux)."""
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(min([own, *(math.ceil(quota) for quota in _quotas(groups, mount))]), 1)


def _quotas(groups: Path, mount: Path) -> Iterator[float]:
    """Yield the cores that each control group of the process, and each one above it, allows.

    ``groups`` has a line ``0::/path`` (version 2) or ``4:cpu,cpuacct:/path`` (version 1). Within a container the path
    may be one outside of it; the mount's own files speak of the container then.
    """
    try:
        lines = groups.read_text(encoding="utf-8").splitlines()
    except OSError:
        return
    for line in lines:
        _, kinds, path = line.split(":", 2)
        if kinds and "cpu" not in kinds.split(","):
            continue
        home = mount / "cpu" if kinds else mount
        inner = home / path.lstrip("/")
        for folder in (inner, *inner.parents):
            if folder == home or home in folder.parents:
                quota = _quota(folder)
                if quota is not None:
                    yield quota


def _quota(folder: Path) -> float | None:
    """Return the cores that one control group allows, None where it sets no limit."""
    try:
        if (folder / "cpu.max").exists():
            allowed, period = (folder / "cpu.max").read_text(encoding="utf-8").split()
        else:
            allowed = (folder / "cpu.cfs_quota_us").read_text(encoding="utf-8").strip()
            period = (folder / "cpu.cfs_period_us").read_text(encoding="utf-8").strip()
        return None if allowed in {"max", "-1"} else int(allowed) / int(period)
    except (OSError, ValueError, ZeroDivisionError):
        return None


@contextmanager
def single_threaded() -> Iterator[None]:
    """Have processes that start within compute with one thread."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
