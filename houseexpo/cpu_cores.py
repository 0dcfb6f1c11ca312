"""Count the cores that this process may use."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path


def count_cores(groups: Path = Path("/proc/self/cgroup"), mount: Path = Path("/sys/fs/cgroup")) -> int:
    """Return how many cores this process may use, given its affinity and the quota of its control groups (Linux)."""
    own = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(min([own, *(math.ceil(quota) for quota in _quotas(groups, mount))]), 1)


def _quotas(groups: Path, mount: Path) -> Iterator[float]:
    """Yield the number of cores that each control group of the process and each of its parents allows.

    ``groups`` has a line ``0::/path`` (version 2) or ``4:cpu,cpuacct:/path`` (version 1). In a container, the path may
    be one outside of it; the files at the mount's root then describe the container.
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
    """Return the number of cores that one control group allows, None if it sets no limit."""
    try:
        if (folder / "cpu.max").exists():
            allowed, period = (folder / "cpu.max").read_text(encoding="utf-8").split()
        else:
            allowed = (folder / "cpu.cfs_quota_us").read_text(encoding="utf-8").strip()
            period = (folder / "cpu.cfs_period_us").read_text(encoding="utf-8").strip()
        return None if allowed in {"max", "-1"} else int(allowed) / int(period)
    except (OSError, ValueError, ZeroDivisionError):
        return None
