"""Episodes in processes of their own, watched: a policy that dies, or never answers, ends the run with its name.

R1  Which process runs a case makes no difference to its outcome; outcomes come back in the cases' order.
R2  A process notes in shared memory which case and step it is at before its policy is asked.
R3  A process that ends, and one whose step lasts too long, end the run; so does the first error. No process stays.
R4  While kernels are compiled, which may take a minute once, no time passes for a policy.
"""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeAlias

from houseexpo.errors import HouseExpoError, PolicyError
from houseexpo.pseudoslam import kernels
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import Outcome, Runner
from houseexpo.pseudoslam.kernels.compiling import on_compiling
from houseexpo.workers import single_threaded

_LOOK_S = 0.5
NewRunner: TypeAlias = Callable[[], Runner]
"""Is pickled: a ``functools.partial`` of a function of a module."""


@dataclass
class _Worker:
    """A process, its end of the pipe, the case it is at (-1: none), and its notes: step, and when it began."""

    process: BaseProcess
    pipe: Connection
    notes: Any
    case: int = -1


def run_cases(
    new_runner: NewRunner, cases: Sequence[Case], workers: int, decision_limit_s: float, name: str
) -> Iterator[tuple[int, Outcome]]:
    """Yield the numbers of cases and their outcomes, as they are done.

    Parameters
    ----------
    new_runner
        Makes what runs the cases, in each process.
    decision_limit_s
        Seconds that a step may last, the policy's making at the first one included, but not compiling (R4).
    name
        The policy's, for errors.

    Raises
    ------
    PolicyError
        R3, and where a policy raised or returned what is no action.
    """
    waiting = iter(range(len(cases)))
    running: list[_Worker] = []
    try:
        with single_threaded():
            running += [_start(new_runner) for _ in range(min(workers, len(cases)))]
        for worker in running:
            _hand_over(worker, cases, waiting)
        while any(worker.case >= 0 for worker in running):
            yield from _answers(running, cases, waiting, name)
            _check_times(running, cases, decision_limit_s, name)
    finally:
        for worker in running:
            worker.process.kill()
            worker.process.join()
            worker.pipe.close()


def _start(new_runner: NewRunner) -> _Worker:
    context = multiprocessing.get_context("spawn")
    ours, its = context.Pipe()
    notes = context.RawArray("d", 2)
    process = context.Process(target=_serve, args=(new_runner, its, notes), daemon=True)
    process.start()
    its.close()
    return _Worker(process, ours, notes)


def _hand_over(worker: _Worker, cases: Sequence[Case], waiting: Iterator[int]) -> None:
    worker.case = next(waiting, -1)
    worker.notes[1] = 0.0
    if worker.case >= 0:
        with suppress(OSError):  # it has died: that is found when it is asked for its answer
            worker.pipe.send(cases[worker.case])


def _answers(
    running: Sequence[_Worker], cases: Sequence[Case], waiting: Iterator[int], name: str
) -> Iterator[tuple[int, Outcome]]:
    """Yield what has been answered, and hand over the next cases."""
    busy = {worker.pipe: worker for worker in running if worker.case >= 0}
    for pipe in wait(list(busy), timeout=_LOOK_S):
        worker = busy[pipe]  # type: ignore[index]  # pipes are all that was waited for
        try:
            answer = worker.pipe.recv()
        except (EOFError, OSError):
            worker.process.join(_LOOK_S)
            code = worker.process.exitcode
            raise PolicyError(f"{_where(worker, cases, name)}: its process died, exit code {code}") from None
        if isinstance(answer, HouseExpoError):
            raise answer
        number = worker.case
        _hand_over(worker, cases, waiting)
        yield number, answer


def _check_times(running: Sequence[_Worker], cases: Sequence[Case], limit_s: float, name: str) -> None:
    for worker in running:
        began = worker.notes[1]
        if worker.case >= 0 and began and time.monotonic() - began > limit_s:
            raise PolicyError(
                f"{_where(worker, cases, name)}: expected an answer within {limit_s:g} s, found none; "
                "--decision-limit allows more"
            )


def _where(worker: _Worker, cases: Sequence[Case], name: str) -> str:
    return f"policy {name!r}: plan {cases[worker.case].plan_id!r}, step {int(worker.notes[0])}"


def _serve(new_runner: NewRunner, pipe: Connection, notes: Any) -> None:
    """Run the cases that come until nobody is at the other end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to hear

    def note(step: int) -> None:
        notes[0], notes[1] = step, time.monotonic()

    def stop_clock() -> None:
        notes[1] = 0.0

    def start_clock() -> None:
        notes[1] = time.monotonic()

    on_compiling(kernels.__name__, stop_clock, start_clock)  # R4
    with suppress(EOFError, BrokenPipeError):
        try:
            runner = new_runner()
        except HouseExpoError as error:
            pipe.recv()
            pipe.send(error)
            return
        while True:
            case = pipe.recv()
            try:
                outcome: Any = runner.run(case, note)
            except HouseExpoError as error:
                outcome = error
            stop_clock()
            pipe.send(outcome)
