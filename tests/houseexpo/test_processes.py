"""Work that processes share: in order, a few items ahead, and no waiting for a process that died."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from types import SimpleNamespace

import pytest

from houseexpo import progress
from houseexpo.errors import WorkerError
from houseexpo.processes import count_cores, map_in_processes


def squared(number: int) -> int:
    return number * number


def killed_at_seven(number: int) -> int:
    if number == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_answers_come_in_the_order_of_the_items() -> None:
    assert list(map_in_processes(squared, range(50), workers=2, chunk=3)) == [number * number for number in range(50)]
    assert list(map_in_processes(squared, [], workers=2)) == []


def interrupts(_: int) -> bool:
    os.kill(os.getpid(), signal.SIGINT)
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_processes_never_get_ctrl_c_and_the_caller_does() -> None:
    assert list(map_in_processes(interrupts, range(4), workers=2)) == [True] * 4
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_items_are_asked_for_as_they_are_needed() -> None:
    taken: list[int] = []
    before = set(multiprocessing.active_children())

    def endless() -> Iterator[int]:
        while True:
            taken.append(len(taken))
            yield taken[-1]

    found = map_in_processes(squared, endless(), workers=1, chunk=2)
    assert list(islice(found, 5)) == [0, 1, 4, 9, 16]
    assert len(taken) < 20
    (started,) = set(multiprocessing.active_children()) - before
    found.close()  # type: ignore[attr-defined]  # a generator
    end = time.monotonic() + 30  # told to end, it takes a moment
    while started.is_alive() and time.monotonic() < end:
        time.sleep(0.01)
    assert not started.is_alive()


def test_a_killed_process_ends_the_work_with_an_error() -> None:
    with pytest.raises(WorkerError, match="one of 2 worker processes ended before it answered"):
        list(map_in_processes(killed_at_seven, range(40), workers=2))


def test_a_script_without_its_guard_ends_with_an_error(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "from houseexpo.processes import map_in_processes\nprint(list(map_in_processes(abs, [1, 2], 1)))\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1
    assert 'under `if __name__ == "__main__":`' in done.stderr


# How many cores there are.


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


# How far something long is, where no terminal shows it.


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time, to be set; standard error is no terminal in a test."""
    now = [0.0]
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: now[0]))
    return now


@pytest.mark.parametrize(("total", "of"), [(4000, " of 4,000"), (None, "")])
def test_a_log_has_a_line_now_and_then(
    clock: list[float], capsys: pytest.CaptureFixture[str], total: int | None, of: str
) -> None:
    seen = []
    for item in progress.show_progress(range(4000), "drawing", total):
        clock[0] += progress.EVERY_S / 1280  # a power of two in the fraction: no rounding
        seen.append(item)
    assert seen == list(range(4000))
    assert capsys.readouterr().err == f"drawing: 1,280{of}\ndrawing: 2,560{of}\ndrawing: 3,840{of}\n"


def test_quiet_commands_say_nothing(clock: list[float], capsys: pytest.CaptureFixture[str]) -> None:
    log = logging.getLogger("houseexpo")
    before = log.level
    log.setLevel(logging.ERROR)
    try:
        for _ in progress.show_progress(range(3), "drawing", 3):
            clock[0] += 2 * progress.EVERY_S
    finally:
        log.setLevel(before)
    assert capsys.readouterr().err == ""
