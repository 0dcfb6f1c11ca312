"""Map a function over items in worker processes with limits of time and memory; yield each item's result or Failure.

Every item runs in a worker, also with ``workers=1``: a time limit, a memory limit and a crash can be held only from
outside the process that they strike. Workers come from a fork server that holds no state of the caller, and compute
with one thread each, so that N workers use N cores.

Rules for workers that die:

1. The item that a worker was doing goes to another worker at once, before all others; the items behind it lose nothing.
2. An item whose workers have died three times is a failure of its own.
3. A worker that dies before it was ready costs no item anything; where none gets ready, the run ends with an error.

Rules for the limits:

4. Time is the worker's processor time, so that a busy machine costs no item anything. A worker that hardly computes
   hangs: it has as many seconds of wall clock. One that starves has ``_WALL_CLOCK_PER_CPU`` times as many.
5. An item that exceeds a limit is tried once more when all others have ended, alone, by a new worker.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from multiprocessing import connection as pipes
from multiprocessing import forkserver
from multiprocessing.connection import Connection, wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from types import ModuleType
from typing import Any, Generic, Literal, Protocol, TypeVar

from houseexpo.errors import HouseExpoError
from houseexpo.processes import child_environment, hold_interrupts

Item = TypeVar("Item")
Result = TypeVar("Result")
Kind = Literal["timeout", "memory", "killed", "died", "raised", "untried"]


@dataclass(frozen=True)
class Limits:
    """The limits of one item: seconds of its worker's processor time, and bytes of memory allocated by its worker."""

    seconds: float
    memory: int


@dataclass(frozen=True)
class Failure:
    """Why an item has no result.

    ``killed``: the system ended its workers one after the other, as its memory guard does. ``died``: its workers
    crashed one after the other. ``raised``: the function raised, which it should not. ``untried``: nobody has begun it.
    """

    kind: Kind
    detail: str


class Executor(Protocol):
    """Maps a function over items: yields each item with its result or its failure, in the order they end.

    The function, the items and the results are pickled. Modules named in ``preload`` are imported before.
    """

    def __call__(
        self, function: Callable[[Item], Result], items: Iterable[Item], *, limits: Limits, preload: Sequence[str]
    ) -> Iterator[tuple[Item, Result | Failure]]:
        """Begin; items are taken from their iterator as there is room for them."""
        ...


def load_ahead(preload: Sequence[str]) -> None:
    """Begin to import the modules that the workers of the next ``run`` share, in the process that these come from.

    Returns at once. Where the system has no fork server, nothing is begun.
    """
    context = _context(preload)
    if context.get_start_method() == "forkserver":
        with child_environment(), hold_interrupts(), _without_main(load_ahead):
            forkserver.ensure_running()


# A worker process, from both sides of its pipe.
#
# Each worker has a pipe of its own, and only the worker holds the other end. When the worker dies, the pipe ends, and
# no other worker is touched. A worker reports that it is ready and then answers its items in the order in which they
# came. It ends by itself when its parent is gone, also from within an endless loop of compiled code.


_GRACE_S = 10.0
"""How much longer than the limit a worker lives whose parent is gone."""
_LONGEST_TIMER_S = 1e8
_WALL_CLOCK_PER_CPU = 20.0  # wall clock for a second of processor time at most: twenty others share each core
_IDLE = 0.05  # share of the wall clock: a worker that computed less waits for something; one of twenty has as much
_LONGEST_FOLDER = 75  # bytes: a socket's path has 107, and 32 of them are multiprocessing's


@dataclass
class PendingItem(Generic[Item]):
    """An item, the number of workers that died on it, and whether it is tried again alone (R5)."""

    item: Item
    deaths: int = 0
    alone: bool = False


@dataclass
class Worker(Generic[Item]):
    """The parent's side; ``given`` are the items handed over, the first of which runs since ``since``.

    ``spent`` is the worker's processor time at that moment, s, and ``due`` when to look at it next.
    """

    process: BaseProcess
    pipe: Connection
    ready: bool = False
    since: float = 0.0
    spent: float | None = None
    due: float = 0.0
    given: deque[PendingItem[Item]] = field(default_factory=deque)

    def begin(self, limits: Limits) -> None:
        """Note that the first item given begins."""
        self.since, self.spent = time.monotonic(), _processor_s(self.process.pid)
        self.due = self.since + limits.seconds

    def is_late(self, limits: Limits) -> bool:
        """Tell whether the item has exceeded its time (R4); if not, say when to look again."""
        now, spent = time.monotonic(), _processor_s(self.process.pid)
        if now < self.due:
            return False
        if spent is None or self.spent is None:
            return True
        used, passed = spent - self.spent, now - self.since
        if used >= limits.seconds or used < _IDLE * passed or passed > _WALL_CLOCK_PER_CPU * limits.seconds:
            return True
        self.due = now + max(limits.seconds - used, _POLL_S)
        return False

    def kill(self) -> None:
        """End the process, whatever it is doing."""
        if self.process.pid is not None:
            self.process.kill()
        self.close()

    def close(self) -> str:
        """Wait for the process to end, and return its exit code in words."""
        self.pipe.close()
        self.process.join(timeout=5.0)
        if self.process.exitcode is None:  # its end of the pipe is gone and it still stands: a library's doing
            self.process.kill()
            self.process.join()
        code = self.process.exitcode or 0
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"


def _processor_s(pid: int | None) -> float | None:
    """Return the processor time of a process and its threads so far, s; None where the system does not say (Linux)."""
    try:
        with open(f"/proc/{pid}/stat", "rb") as file:  # noqa: PTH123 - thousands of times
            fields = file.read().rpartition(b")")[2].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def start_worker(function: Callable[[Item], Any], limits: Limits, preload: Sequence[str]) -> Worker[Item]:
    """Start a worker; raise OSError or EOFError if the fork server has just been killed."""
    context = _context(preload)
    near, far = context.Pipe()
    process = context.Process(target=serve_items, args=(far, function, limits), daemon=True)  # type: ignore[attr-defined]
    try:
        # Ctrl-C is the parent's business: what starts here never sees it
        with hold_interrupts(), _without_main(function):
            process.start()
    except BaseException:
        near.close()
        raise
    finally:
        far.close()
    return Worker(process, near)


@contextmanager
def _without_main(function: Callable[..., Any]) -> Iterator[None]:
    """Let a worker start without importing the caller's script, which may have no ``if __name__ == "__main__"``.

    multiprocessing imports the script in each process that it starts, for what may be pickled from it. What runs here
    stands in modules, unless ``function`` itself comes from the script.
    """
    main = sys.modules.get("__main__")
    whole = function.func if isinstance(function, partial) else function
    if main is None or getattr(whole, "__module__", "__main__") == "__main__":
        yield
        return
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def serve_items(pipe: Connection, function: Callable[[Item], Any], limits: Limits) -> None:
    """Answer items until the pipe ends: the worker's side. It ends or is reset when the other end is closed."""
    with suppress(EOFError, ConnectionError):
        try:
            _prepare(limits)
            pipe.send(("ready", None))
        except (MemoryError, ImportError, OSError, ValueError) as error:
            pipe.send(("unfit", f"{type(error).__name__}: {error}"))
            return
        while True:
            item = pipe.recv()
            signal.setitimer(signal.ITIMER_REAL, min(_WALL_CLOCK_PER_CPU * limits.seconds + _GRACE_S, _LONGEST_TIMER_S))
            _answer(pipe, function, item, limits)
            signal.setitimer(signal.ITIMER_REAL, 0)
            if _peak_bytes() > limits.memory / 2:  # what it holds must not count against the next item
                pipe.send(("leaving", None))
                return


def _answer(pipe: Connection, function: Callable[[Item], Any], item: Item, limits: Limits) -> None:
    answer: Any
    try:
        answer = function(item)
    except MemoryError:
        answer = Failure("memory", f"needed more than {limits.memory / 2**30:g} GiB")
    except Exception as error:  # noqa: BLE001 - whatever the function raised is this item's, not the batch's
        answer = Failure("raised", f"{type(error).__name__}: {error}")
    pipe.send(("answer", answer))


def _prepare(limits: Limits) -> None:
    """Set up a worker: OpenCV gets one thread, allocations get a limit, and it does not outlive its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)  # ends the process from outside of Python
    threading.Thread(target=_end_with_parent, daemon=True).start()
    import cv2

    cv2.setNumThreads(1)
    gc.freeze()  # what is loaded is no garbage; to look it through time and again is a twentieth of a house
    _limit_memory(limits.memory)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        pipes.wait([parent.sentinel])
        os._exit(0)


def _limit_memory(memory: int) -> None:
    """Make allocations beyond ``memory`` bytes raise MemoryError, where the system can (Linux)."""
    try:
        import resource
    except ImportError:
        return
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    if memory < 2**62:
        resource.setrlimit(
            resource.RLIMIT_DATA, (memory if hard == resource.RLIM_INFINITY else min(memory, hard), hard)
        )


def _peak_bytes() -> int:
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _context(preload: Sequence[str]) -> BaseContext:
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    folder = tempfile.gettempdir()
    if len(os.fsencode(folder)) > _LONGEST_FOLDER:
        raise HouseExpoError(
            f"the folder for temporary files: expected a path of at most {_LONGEST_FOLDER} bytes, because sockets of "
            f"the workers lie in it; found {folder}; set TMPDIR to a shorter one"
        )
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["__main__", *preload])
    return context


_ITEMS_AHEAD = 4  # items handed over to each worker, so that none of them waits for the next
_DEATHS = 3  # R2
_FAILED_STARTS = 8  # R3: how many workers in a row may die before they are ready, for each that is wanted
_POLL_S = 0.1
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
    with child_environment():
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
    again: deque[PendingItem[Item]] = field(default_factory=deque)
    last: deque[PendingItem[Item]] = field(default_factory=deque)
    failed_starts: int = 0

    def hand_over(self) -> bool:
        """Give every worker that is ready something to do, or False if all is done."""
        for ahead in range(_ITEMS_AHEAD):
            for worker in self.workers:
                if worker.ready and len(worker.given) <= ahead and (task := self._next()) is not None:
                    self._give(worker, task)
        while len(self.workers) < self.size and self._too_few():
            self._start_worker()
        if not self.again and self.last and not any(worker.given for worker in self.workers):
            self.stop()
            self.size = 1
            self.again.append(self.last.popleft())  # R5
            self._start_worker()
        return bool(self.again) or any(worker.given for worker in self.workers)

    def collect(self) -> Iterator[tuple[Item, Result | Failure]]:
        """Wait for an event, and yield the items that have ended."""
        pipes: dict[Any, Worker[Item]] = {worker.pipe: worker for worker in self.workers}
        heard = {id(pipes[pipe]) for pipe in wait(list(pipes), self._seconds_to_limit())}
        for worker in pipes.values():
            if id(worker) in heard:
                yield from self._listen(worker)
            elif worker.given and worker.is_late(self.limits):
                task = worker.given.popleft()
                self._remove_worker(worker)
                worker.kill()
                yield from self._end(task, Failure("timeout", f"took longer than {self.limits.seconds:g} s"))

    def stop(self) -> None:
        """Stop all workers at once."""
        for worker in self.workers:
            worker.kill()
        self.workers.clear()

    def _end(self, task: PendingItem[Item], result: Result | Failure) -> Iterator[tuple[Item, Result | Failure]]:
        """Yield an item and its result, unless it exceeded a limit and is to be tried again (R5)."""
        if isinstance(result, Failure) and result.kind in {"timeout", "memory"} and not task.alone:
            task.alone = True
            self.last.append(task)
            return
        yield task.item, result

    def _next(self) -> PendingItem[Item] | None:
        if self.again:
            return self.again.popleft()
        return next((PendingItem(item) for item in self.items), None)

    def _too_few(self) -> bool:
        """Tell whether more items wait than workers are on their way."""
        coming = sum(not worker.ready for worker in self.workers)
        self.again.extend(PendingItem(item) for item in islice(self.items, max(coming + 1 - len(self.again), 0)))
        return len(self.again) > coming

    def _give(self, worker: Worker[Item], task: PendingItem[Item]) -> None:
        if not worker.given:
            worker.begin(self.limits)
        worker.given.append(task)
        try:
            worker.pipe.send(task.item)
        except OSError:  # it has just died: its pipe tells when it is listened to
            return

    def _start_worker(self) -> None:
        try:
            self.workers.append(start_worker(self.function, self.limits, self.preload))
        except (OSError, EOFError) as error:  # the server has just been killed, or there is no room for a process
            self._note_failed_start(f"{type(error).__name__}: {error}")
            time.sleep(_POLL_S)

    def _listen(self, worker: Worker[Item]) -> Iterator[tuple[Item, Result | Failure]]:
        """Handle one message of a worker, or its death."""
        try:
            kind, content = worker.pipe.recv()
        except (EOFError, OSError):
            yield from self._handle_death(worker)
            return
        if kind == "answer":
            task = worker.given.popleft()
            worker.begin(self.limits)
            yield from self._end(task, content)
        elif kind == "ready":
            worker.ready, self.failed_starts = True, 0
        else:
            self._remove_worker(worker)
            worker.close()
            if kind == "unfit":
                self._note_failed_start(content)

    def _handle_death(self, worker: Worker[Item]) -> Iterator[tuple[Item, Result | Failure]]:
        """Handle a worker's death."""
        task = worker.given[0] if worker.given else None
        self._remove_worker(worker)
        end = worker.close()
        if not worker.ready:
            self._note_failed_start(f"it ended with {end}")  # R3
        elif task is not None:
            task.deaths += 1
            if task.deaths >= _DEATHS:  # R2
                self.again.popleft()
                yield task.item, _failure(end)

    def _remove_worker(self, worker: Worker[Item]) -> None:
        """Remove a worker; its items are done next, in their order (R1)."""
        self.workers.remove(worker)
        self.again.extendleft(reversed(worker.given))
        worker.given.clear()

    def _note_failed_start(self, why: str) -> None:
        self.failed_starts += 1
        if self.failed_starts > _FAILED_STARTS * self.size:
            raise HouseExpoError(
                f"workers cannot be started: {self.failed_starts} in a row ended before their first house, the last "
                f"since {why}; try fewer --workers, or more --memory"
            )

    def _seconds_to_limit(self) -> float:
        """Return the seconds until the next time limit."""
        ends = [worker.due for worker in self.workers if worker.given]
        return max(min([*ends, time.monotonic() + _LONGEST_S]) - time.monotonic(), 0.0)


def _failure(end: str) -> Failure:
    if end == "SIGKILL":
        return Failure("killed", f"its workers were killed by the system, {_DEATHS} of {_DEATHS}")
    return Failure("died", f"its workers died with {end}, {_DEATHS} of {_DEATHS}")
