"""Work that processes share: in order, a few items ahead, and no waiting for a process that died."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import pytest

from houseexpo.errors import WorkerError
from houseexpo.processes import map_in_processes


def squared(number: int) -> int:
    return number * number


def killed_at_seven(number: int) -> int:
    if number == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_answers_come_in_the_order_of_the_items() -> None:
    assert list(map_in_processes(squared, range(50), workers=2, chunk=3)) == [number * number for number in range(50)]
    assert list(map_in_processes(squared, [], workers=2)) == []


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
