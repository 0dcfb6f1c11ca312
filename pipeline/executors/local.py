"""Map a function over items in worker processes of this machine.

Every item runs in a worker, also with ``workers=1``: a time limit, a memory limit and a crash can be held only from
outside the process that they strike. Workers come from a fork server that holds no state of the caller, and compute
with one thread each, so that N workers use N cores.

Rules for workers that die:

1. The item that a worker was doing goes to another worker at once, before all others; the items behind it lose nothing.
2. An item whose workers have died three times is a failure of its own.
3. A worker that dies before it was ready costs no item anything; where none gets ready, the run ends with an error.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from multiprocessing.connection import wait
from typing import Any, Generic

from houseexpo.errors import HouseExpoError
from houseexpo.workers import single_threaded
from pipeline.executors.outcome import Failure, Item, Limits, Result
from pipeline.executors.worker import Task, Worker, start

__all__ = ["Failure", "Limits", "run"]

_AHEAD = 4  # items handed over to each worker, so that none of them waits for the next
_DEATHS = 3  # R2
_FAILED_STARTS = 8  # R3: how many workers in a row may die before they are ready, for each that is wanted
_PAUSE_S = 0.1
_LONGEST_S = 3600.0  # how long to sleep at most


def run(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    *,
    workers: int,
    limits: Limits,
    preload: Sequence[str] = (),
) -> Iterator[tuple[Item, Result | Failure]]:
    """Yield each item with its result or its failure, in the order in which they end.

    ``function`` and the items are pickled; items are taken from their iterator as workers get free. Closing the
    iterator early stops the workers. Modules named in ``preload`` are imported once for all workers.

    Raises
    ------
    HouseExpoError
        Where no worker can be started.
    """
    with single_threaded():
        pool = _Pool(function, iter(items), workers, limits, preload)
        try:
            while pool.hand_over():
                yield from pool.collect()
        finally:
            pool.stop()


@dataclass
class _Pool(Generic[Item, Result]):
    """The running workers, the waiting items, and the number of workers in a row that never became ready (R3)."""

    function: Callable[[Item], Result]
    items: Iterator[Item]
    size: int
    limits: Limits
    preload: Sequence[str]
    workers: list[Worker[Item]] = field(default_factory=list)
    again: deque[Task[Item]] = field(default_factory=deque)
    failed_starts: int = 0

    def hand_over(self) -> bool:
        """Give every worker that is ready something to do, or False if all is done."""
        for ahead in range(_AHEAD):
            for worker in self.workers:
                if worker.ready and len(worker.given) <= ahead and (task := self._next()) is not None:
                    self._give(worker, task)
        while len(self.workers) < self.size and self._too_few():
            self._start_worker()
        return bool(self.again) or any(worker.given for worker in self.workers)

    def collect(self) -> Iterator[tuple[Item, Result | Failure]]:
        """Wait for an event, and yield the items that have ended."""
        pipes: dict[Any, Worker[Item]] = {worker.pipe: worker for worker in self.workers}
        heard = {id(pipes[pipe]) for pipe in wait(list(pipes), self._patience())}
        for worker in pipes.values():
            if id(worker) in heard:
                yield from self._listen(worker)
            elif worker.given and time.monotonic() >= worker.since + self.limits.seconds:
                task = worker.given.popleft()
                self._lose(worker)
                worker.kill()
                yield task.item, Failure("timeout", f"took longer than {self.limits.seconds:g} s")

    def stop(self) -> None:
        """Stop all workers at once."""
        for worker in self.workers:
            worker.kill()
        self.workers.clear()

    def _next(self) -> Task[Item] | None:
        if self.again:
            return self.again.popleft()
        return next((Task(item) for item in self.items), None)

    def _too_few(self) -> bool:
        """Tell whether more items wait than workers are on their way."""
        coming = sum(not worker.ready for worker in self.workers)
        self.again.extend(Task(item) for item in islice(self.items, max(coming + 1 - len(self.again), 0)))
        return len(self.again) > coming

    def _give(self, worker: Worker[Item], task: Task[Item]) -> None:
        if not worker.given:
            worker.since = time.monotonic()
        worker.given.append(task)
        try:
            worker.pipe.send(task.item)
        except OSError:  # it has just died: its pipe tells when it is listened to
            return

    def _start_worker(self) -> None:
        try:
            self.workers.append(start(self.function, self.limits, self.preload))
        except (OSError, EOFError) as error:  # the server has just been killed, or there is no room for a process
            self._note_failed_start(f"{type(error).__name__}: {error}")
            time.sleep(_PAUSE_S)

    def _listen(self, worker: Worker[Item]) -> Iterator[tuple[Item, Result | Failure]]:
        """Handle one message of a worker, or its death."""
        try:
            kind, content = worker.pipe.recv()
        except (EOFError, OSError):
            yield from self._ended(worker)
            return
        if kind == "answer":
            worker.since = time.monotonic()
            yield worker.given.popleft().item, content
        elif kind == "ready":
            worker.ready, self.failed_starts = True, 0
        else:
            self._lose(worker)
            worker.close()
            if kind == "unfit":
                self._note_failed_start(content)

    def _ended(self, worker: Worker[Item]) -> Iterator[tuple[Item, Result | Failure]]:
        """Handle a worker's death."""
        task = worker.given[0] if worker.given else None
        self._lose(worker)
        end = worker.close()
        if not worker.ready:
            self._note_failed_start(f"it ended with {end}")  # R3
        elif task is not None:
            task.deaths += 1
            if task.deaths >= _DEATHS:  # R2
                self.again.popleft()
                yield task.item, _failure(end)

    def _lose(self, worker: Worker[Item]) -> None:
        """Remove a worker; its items are done next, in their order (R1)."""
        self.workers.remove(worker)
        self.again.extendleft(reversed(worker.given))
        worker.given.clear()

    def _note_failed_start(self, why: str) -> None:
        self.failed_starts += 1
        if self.failed_starts > _FAILED_STARTS * self.size:
            raise HouseExpoError(
                f"workers cannot be started: {self.failed_starts} in a row ended before their first house, the last "
                f"since {why}; try fewer --workers, or a higher limits.memory_gb"
            )

    def _patience(self) -> float:
        """Return the seconds until the next time limit."""
        ends = [worker.since + self.limits.seconds for worker in self.workers if worker.given]
        return max(min([*ends, time.monotonic() + _LONGEST_S]) - time.monotonic(), 0.0)


def _failure(end: str) -> Failure:
    if end == "SIGKILL":
        return Failure("killed", f"its workers were killed by the system, {_DEATHS} of {_DEATHS}")
    return Failure("died", f"its workers died with {end}, {_DEATHS} of {_DEATHS}")
