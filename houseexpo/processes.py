"""Count the cores for processes, start them, and map a function over items in several of them, in the items' order.

R1  Items are requested as they are needed: only a few chunks per process wait, not the whole data set.
R2  Results come in the order of the items, so that the number of processes does not change them.
R3  If a process dies, the work ends with an error at once instead of waiting for the missing result.
R4  The caller handles Ctrl-C, and ends the processes; they never get it, also while they start.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import islice
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, Final, TypeVar

from houseexpo.errors import WorkerError


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


Item = TypeVar("Item")
Answer = TypeVar("Answer")

_CHUNKS_AHEAD: Final = 4
"""Number of chunks per process that are requested in advance."""


THREADS: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
    "NUMBA_NUM_THREADS",
)
"""Environment variables that libraries read when they are loaded."""

SAFE_PATH: Final = "PYTHONSAFEPATH"
"""An environment variable: where it is set, Python does not look for modules in the working directory."""


@contextmanager
def child_environment() -> Iterator[None]:
    """Make Python processes that start in this context compute with one thread, and run no file of this folder.

    More threads than cores would slow each other down. A process that multiprocessing starts, its fork server and its
    resource tracker among them, would look for modules in the working directory first, and run a ``numpy.py`` that lies
    in a downloaded folder (cpython issue 117378).
    """
    wanted = {**dict.fromkeys(THREADS, "1"), SAFE_PATH: "1"}
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def hold_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back; processes that start within never get it.

    The tracker of multiprocessing is started first: starting it lets Ctrl-C through again.
    """
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def map_in_processes(
    work: Callable[[Item], Answer], items: Iterable[Item], workers: int, chunk: int = 1
) -> Iterator[Answer]:
    """Yield the result of ``work`` for each item; ``chunk`` items are sent to a process at once.

    ``work`` and the items must be picklable. The processes are spawned, so that a script that calls this needs
    ``if __name__ == "__main__"``.

    Raises
    ------
    WorkerError
        A process ended before it returned its result.
    """
    chunks = split_into_chunks(items, chunk)
    before = set(multiprocessing.active_children())
    spawning = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(workers, spawning)
    waiting = deque[Future[list[Answer]]]()

    def ask(number: int) -> None:
        for each in islice(chunks, number):
            with child_environment(), hold_interrupts():  # R4; the executor starts processes on demand
                waiting.append(executor.submit(_answers, work, each))

    try:
        ask(_CHUNKS_AHEAD * workers)
        while waiting:
            yield from waiting.popleft().result()
            ask(1)  # R1
    except BrokenProcessPool:  # R3
        raise WorkerError(
            f"one of {workers} worker processes ended before it answered. It was killed (where memory is short the "
            "system does so: try fewer workers), or the script that asked for them starts its work on import: put "
            'that under `if __name__ == "__main__":`'
        ) from None
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()  # R4: nobody waits for the remaining work


def split_into_chunks(items: Iterable[Item], size: int) -> Iterator[list[Item]]:
    """Yield the items in lists of ``size``; the last list may be shorter."""
    source = iter(items)
    return iter(lambda: list(islice(source, size)), [])


def _answers(work: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    return [work(each) for each in items]
