"""A worker process, from both sides of its pipe.

Each worker has a pipe of its own, and only the worker holds the other end: when it dies, however it dies, the pipe
ends, and no other worker is touched. It says when it is ready, then answers its items in the order in which they came.
A worker ends by itself when its parent is gone, also from within an endless loop of compiled code.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import connection as pipes
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from types import ModuleType
from typing import Any, Generic

from houseexpo.errors import HouseExpoError
from pipeline.executors.outcome import Failure, Item, Limits

_GRACE_S = 10.0
"""How much longer than the limit a worker lives whose parent is gone."""
_LONGEST_S = 1e8
_LONGEST_FOLDER = 75  # bytes: a socket's path has 107, and 32 of them are multiprocessing's


@dataclass
class Task(Generic[Item]):
    """An item, and the number of workers that died on it."""

    item: Item
    deaths: int = 0


@dataclass
class Worker(Generic[Item]):
    """The parent's side; ``given`` are the items handed over, the first of which runs since ``since``."""

    process: BaseProcess
    pipe: Connection
    ready: bool = False
    since: float = 0.0
    given: deque[Task[Item]] = field(default_factory=deque)

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


def start(function: Callable[[Item], Any], limits: Limits, preload: Sequence[str]) -> Worker[Item]:
    """Start a worker; raise OSError or EOFError if the fork server has just been killed."""
    context = _context(preload)
    near, far = context.Pipe()
    process = context.Process(target=serve, args=(far, function, limits), daemon=True)  # type: ignore[attr-defined]
    try:
        # Ctrl-C is the parent's business: what starts here never sees it
        with _uninterrupted(), _without_main(function):
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


def serve(pipe: Connection, function: Callable[[Item], Any], limits: Limits) -> None:
    """Answer items until the pipe ends: the worker's side."""
    try:
        _prepare(limits)
        pipe.send(("ready", None))
    except (MemoryError, ImportError, OSError, ValueError) as error:
        pipe.send(("unfit", f"{type(error).__name__}: {error}"))
        return
    while True:
        try:
            item = pipe.recv()
        except EOFError:
            return
        signal.setitimer(signal.ITIMER_REAL, min(limits.seconds + _GRACE_S, _LONGEST_S))
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


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back; processes that start within never get it.

    The tracker of multiprocessing is started first: starting it lets Ctrl-C through again.
    """
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
