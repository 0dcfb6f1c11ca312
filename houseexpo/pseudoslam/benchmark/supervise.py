"""Run episodes in supervised processes: a policy that dies or does not answer ends the run with an error.

R1  The outcome of a case does not depend on the process that runs it; outcomes are returned in the cases' order.
R2  Before each call of the policy, a process writes the current case and step to shared memory.
R3  The run ends if a process ends, if a step takes too long, and at the first error. No process is left over.
R4  The time for compiling kernels, which may be a minute once, does not count.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeAlias

from houseexpo.errors import HouseExpoError, PolicyError
from houseexpo.processes import child_environment, hold_interrupts
from houseexpo.pseudoslam import kernels
from houseexpo.pseudoslam.benchmark.cases import Case
from houseexpo.pseudoslam.benchmark.episodes import EpisodeOutcome, EpisodeRunner
from houseexpo.pseudoslam.kernels.compiling import call_around_compiling

_WORKER_LOOK_S = 0.5
NewRunner: TypeAlias = Callable[[], EpisodeRunner]
"""A function that makes a runner. It is pickled: a ``functools.partial`` of a function of a module."""


@dataclass
class _Worker:
    """A process, its pipe, its current case (-1 for none), and its notes: the step, and when that began."""

    process: BaseProcess
    pipe: Connection
    notes: Any
    case: int = -1


def run_cases(
    new_runner: NewRunner, cases: Sequence[Case], workers: int, decision_limit_s: float, name: str
) -> Iterator[tuple[int, EpisodeOutcome]]:
    """Yield the numbers of cases and their outcomes as they are done.

    Parameters
    ----------
    new_runner
        A function that makes the runner of the cases in each process.
    decision_limit_s
        Time limit of a step in seconds; the first one includes creating the policy, but not compiling (R4).
    name
        The name of the policy, for errors.

    Raises
    ------
    PolicyError
        A process ended or a step took too long (R3), or a policy raised an exception or returned an invalid action.
    """
    waiting = iter(range(len(cases)))
    running: list[_Worker] = []
    try:
        with child_environment(), hold_interrupts():
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
        with suppress(OSError):  # it has died, which is noticed when its answer is read
            worker.pipe.send(cases[worker.case])


def _answers(
    running: Sequence[_Worker], cases: Sequence[Case], waiting: Iterator[int], name: str
) -> Iterator[tuple[int, EpisodeOutcome]]:
    """Yield the answers, and send the next cases."""
    busy = {worker.pipe: worker for worker in running if worker.case >= 0}
    for pipe in wait(list(busy), timeout=_WORKER_LOOK_S):
        worker = busy[pipe]  # type: ignore[index]  # pipes are all that was waited for
        try:
            answer = worker.pipe.recv()
        except (EOFError, OSError):
            worker.process.join(_WORKER_LOOK_S)
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
    """Run the cases that arrive until the other end of the pipe is closed."""
    spent = 0.0  # of the current step, while the clock stands

    def note(step: int) -> None:
        notes[0], notes[1] = step, time.monotonic()

    def stop_clock() -> None:
        nonlocal spent
        spent = time.monotonic() - notes[1] if notes[1] else 0.0
        notes[1] = 0.0

    def start_clock() -> None:
        notes[1] = time.monotonic() - spent

    call_around_compiling(kernels.__name__, stop_clock, start_clock)  # R4
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
