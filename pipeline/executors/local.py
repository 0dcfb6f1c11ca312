"""Map a function over items in worker processes of this machine.

Every item runs in a worker, also with ``workers=1``: a time limit, a memory limit and a crash can be held only from
outside the process that they strike. Workers come from a fork server that holds no state of the caller, and compute
with one thread each, so that N workers use N cores.
"""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import signal
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from multiprocessing.context import BaseContext
from typing import Any, Literal, TypeVar

from pebble import ProcessExpired, ProcessPool

from houseexpo.workers import single_threaded

Item = TypeVar("Item")
Result = TypeVar("Result")

_AHEAD = 8  # items handed over for each worker, so that none of them waits for the next


@dataclass(frozen=True)
class Limits:
    """What one item may take: seconds of wall clock, bytes of memory that its worker allocates."""

    seconds: float
    memory: int


@dataclass(frozen=True)
class Failure:
    """Why an item has no result. ``killed`` is how the system's own memory guard ends a process."""

    kind: Literal["timeout", "memory", "killed", "died", "raised"]
    detail: str


def run(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    *,
    workers: int,
    limits: Limits,
    preload: Sequence[str] = (),
) -> Iterator[tuple[Item, Result | Failure]]:
    """Yield each item with its result or why it has none, in the order in which they end.

    ``function`` and the items are pickled. A worker that dies takes only its own item with it: another starts in its
    place. Closing the iterator early stops the workers. Modules named in ``preload`` are imported once for all workers.
    """
    waiting = iter(items)
    running: dict[Future[Result], Item] = {}
    with single_threaded(), _pool(workers, limits.memory, preload) as pool:
        while True:
            for item in islice(waiting, workers * _AHEAD - len(running)):
                running[pool.schedule(function, args=(item,), timeout=limits.seconds)] = item
            if not running:
                return
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in [one for one in running if one in done]:  # many may have ended: as they were handed over
                outcome: Result | Failure = _outcome(future, limits)
                yield running.pop(future), outcome


def _outcome(future: Future[Result], limits: Limits) -> Result | Failure:
    try:
        return future.result()
    except concurrent.futures.TimeoutError:
        return Failure("timeout", f"took longer than {limits.seconds:g} s")
    except MemoryError:
        return Failure("memory", f"needed more than {limits.memory / 2**30:g} GiB")
    except ProcessExpired as error:
        if error.exitcode == -signal.SIGKILL:
            return Failure("killed", "its worker was killed by the system")
        return Failure("died", f"its worker died with {_name(error.exitcode)}")
    except Exception as error:  # noqa: BLE001 - whatever the function raised is this item's, not the batch's
        return Failure("raised", f"{type(error).__name__}: {error}")


def _name(exitcode: int) -> str:
    return signal.Signals(-exitcode).name if exitcode < 0 else f"exit code {exitcode}"


@contextmanager
def _pool(workers: int, memory: int, preload: Sequence[str]) -> Iterator[ProcessPool]:
    """Open a pool; it is stopped at once where the caller leaves early, say by Ctrl-C."""
    pool = ProcessPool(max_workers=workers, initializer=_prepare, initargs=(memory,), context=_context(preload))
    try:
        yield pool
        pool.close()
    finally:
        pool.stop()
        pool.join()


def _context(preload: Sequence[str]) -> BaseContext:
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["__main__", *preload])
    return context


def _prepare(memory: int) -> None:
    """Set up a worker: Ctrl-C is the caller's business, OpenCV gets one thread, allocations get a limit."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    import cv2

    cv2.setNumThreads(1)
    _limit_memory(memory)


def _limit_memory(memory: int) -> None:
    """Make allocations beyond ``memory`` bytes raise MemoryError, where the system can (Linux)."""
    try:
        import resource
    except ImportError:
        return
    limit: Any = (memory, resource.getrlimit(resource.RLIMIT_DATA)[1])
    resource.setrlimit(resource.RLIMIT_DATA, limit)
