from __future__ import annotations

import os
from pathlib import Path

import pytest

from houseexpo.cpu_cores import count_cores

OWN = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def grouped(root: Path, line: str, files: dict[str, str]) -> int:
    (root / "cgroup").write_text(f"{line}\n")
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return count_cores(root / "cgroup", root / "fs")


@pytest.mark.parametrize(
    ("line", "files", "expected"),
    [
        ("0::/box", {"fs/box/cpu.max": "100000 100000\n"}, 1),
        ("0::/box/inner", {"fs/box/cpu.max": "50000 100000\n", "fs/box/inner/cpu.max": "max 100000\n"}, 1),
        ("0::/elsewhere", {"fs/cpu.max": "100000 100000\n"}, 1),
        ("0::/", {"fs/cpu.max": "max 100000\n"}, OWN),
        ("0::/", {"fs/cpu.max": "6400000 100000\n"}, OWN),
        ("0::/", {"fs/cpu.max": "nonsense\n"}, OWN),
        ("4:cpu,cpuacct:/box", {"fs/cpu/box/cpu.cfs_quota_us": "90000", "fs/cpu/box/cpu.cfs_period_us": "100000"}, 1),
        ("4:cpu,cpuacct:/box", {"fs/cpu/box/cpu.cfs_quota_us": "-1", "fs/cpu/box/cpu.cfs_period_us": "100000"}, OWN),
        ("5:memory:/box", {"fs/cpu/box/cpu.cfs_quota_us": "1", "fs/cpu/box/cpu.cfs_period_us": "1"}, OWN),
    ],
)
def test_cores_are_those_that_the_control_group_allows(
    line: str, files: dict[str, str], expected: int, tmp_path: Path
) -> None:
    assert grouped(tmp_path, line, files) == expected


def test_without_control_groups_the_affinity_counts(tmp_path: Path) -> None:
    assert count_cores(tmp_path / "none", tmp_path) == OWN
