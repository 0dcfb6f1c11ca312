"""Work that several processes share, each computing with one thread.

1. Items are asked for as they are needed: a few chunks a process wait, not a data set.
2. Answers come in the order of the items, so the number of processes changes nothing.
3. A process that dies ends the work with an error; the answer that it owed is not waited for.
4. Ctrl-C is the caller's: the processes end with it, and say nothing.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from itertools import islice
from typing import Any, Final, TypeVar

from houseexpo.errors import WorkerError
from houseexpo.workers import single_threaded

Item = TypeVar("Item")
Answer = TypeVar("Answer")

_AHEAD: Final = 4
"""So many chunks a process are asked for before the first is answered."""


def in_processes(
    work: Callable[[Item], Answer], items: Iterable[Item], workers: int, chunk: int = 1
) -> Iterator[Answer]:
    """Yield what ``work`` makes of each item; ``chunk`` items go to a process at once.

    Both must pickle. A script that calls this needs its ``if __name__ == "__main__"``: the processes are spawned.

    Raises
    ------
    WorkerError
        Where a process ends before it has answered.
    """
    chunks = in_chunks(items, chunk)
    before = set(multiprocessing.active_children())
    spawning = multiprocessing.get_context("spawn")
    executor = ProcessPoolExecutor(workers, spawning, initializer=_leave_ctrl_c_to_the_caller)
    waiting = deque[Future[list[Answer]]]()

    def ask(number: int) -> None:
        for each in islice(chunks, number):
            with single_threaded():  # the executor starts its processes as they are needed
                waiting.append(executor.submit(_answers, work, each))

    try:
        ask(_AHEAD * workers)
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
            process.terminate()  # R4: what is still at work has nobody who waits for it


def in_chunks(items: Iterable[Item], size: int) -> Iterator[list[Item]]:
    """Yield the items in lists of ``size``, the last one shorter where they do not come out even."""
    source = iter(items)
    return iter(lambda: list(islice(source, size)), [])


def _leave_ctrl_c_to_the_caller() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _answers(work: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    return [work(each) for each in items]
