"""Threads that share steps: each environment once, whoever takes it, and nobody waits for who is gone."""

from __future__ import annotations

import contextlib
import gc
import multiprocessing
import os
import threading
import time
from typing import Any

import numpy as np
import pytest
from numba import njit

from houseexpo.pseudoslam.crew import Crew
from houseexpo.pseudoslam.kernels.crew import FAILED, INSIDE, done, enter, leave, new_crew, take

compiled_only = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="words are no atoms in Python")


@njit(nogil=True)
def counting(counts: np.ndarray, by: np.ndarray, scratch: int, crew: np.ndarray, epoch: int, thread: int) -> None:
    """Count how often each one is taken, and note by whom; each takes some time."""
    enter(crew, thread)
    while True:
        i = take(crew, epoch, thread)
        if i < 0:
            break
        for _ in range(300):
            counts[i, 1] = (counts[i, 1] * 31 + 7) % 1009
        counts[i, 0] += 1
        by[i] = thread
        done(crew)
    leave(crew, thread)


def crew_of(number: int, threads: int) -> Crew:
    return Crew(number, [0] * threads)  # type: ignore[list-item]  # no scratch is needed here


def wait_for(true: Any) -> None:
    """Return when something comes true; fail after ten seconds."""
    end = time.monotonic() + 10.0
    while not true() and time.monotonic() < end:
        time.sleep(0.001)
    assert true()


def test_alone_one_takes_all_from_the_first_on() -> None:
    crew, order = new_crew(5, 1), np.zeros((5, 2), np.int64)
    for k in range(1, 4):
        counting(order, np.full(5, 9), 0, crew, 0, 0)
        assert (order[:, 0] == k).all()


@compiled_only
@pytest.mark.parametrize(("number", "threads"), [(1, 2), (2, 3), (7, 2), (64, 3)])
def test_each_is_taken_once_a_step(number: int, threads: int) -> None:
    crew = crew_of(number, threads)
    counts, by, seen = np.zeros((number, 2), np.int64), np.zeros(number, np.int64), set()
    crew.take_on(counting, counts, by)
    for k in range(1, 2001):
        crew.step()
        assert (counts[:, 0] == k).all()
        seen |= set(by.tolist())
        if k % 500 == 0:  # once they sleep
            time.sleep(0.01)

    def somebody_helps() -> bool:
        crew.step()
        seen.update(by.tolist())
        return number == 1 or len(seen) > 1

    wait_for(somebody_helps)
    crew.close()


@compiled_only
def test_arrays_change_between_two_steps() -> None:
    """Who looks out for a step of the old ones leaves; nothing is written where nothing is read any more."""
    crew, expected = crew_of(9, 3), np.zeros(9, np.int64)
    for _ in range(300):
        counts = np.zeros((9, 2), np.int64)
        crew.take_on(counting, counts, np.zeros(9, np.int64))
        for k in range(1, 4):
            crew.step()
            assert (counts[:, 0] == k).all()
        expected += counts[:, 0]
    assert (expected == 900).all()
    crew.close()


def test_threads_end_with_their_crew() -> None:
    before = set(threading.enumerate())
    crew, other = crew_of(4, 3), crew_of(4, 2)
    first, second, third = sorted(set(threading.enumerate()) - before, key=lambda thread: thread.ident or 0)
    assert all(thread.daemon for thread in (first, second, third))
    crew.close()
    crew.close()
    wait_for(lambda: sum(thread.is_alive() for thread in (first, second, third)) == 1)
    del other
    gc.collect()
    wait_for(lambda: not any(thread.is_alive() for thread in (first, second, third)))


def test_a_thread_that_fails_is_heard_of() -> None:
    def failing(*arguments: Any) -> None:
        if arguments[-1] > 0:
            raise MemoryError("no room")

    crew = crew_of(4, 2)
    crew.take_on(failing)
    with contextlib.suppress(RuntimeError):  # it may have failed by the end of this one
        crew.step()
    wait_for(lambda: crew._shared.words[FAILED])
    with pytest.raises(RuntimeError, match="has failed; make another") as caught:
        crew.step()
    assert isinstance(caught.value.__cause__, MemoryError)


def test_an_interrupted_step_is_not_the_last() -> None:
    crew, steps = crew_of(4, 1), []

    def interrupted_once(*_: Any) -> None:
        steps.append(1)
        if len(steps) == 1:
            raise KeyboardInterrupt

    crew.take_on(interrupted_once)
    with pytest.raises(KeyboardInterrupt):
        crew.step()
    crew.step()
    assert len(steps) == 2


def in_a_fork(crew: Crew, counts: np.ndarray, answers: Any) -> None:
    crew.step()
    answers.put(counts[:, 0].tolist())


@pytest.mark.filterwarnings("ignore:.*fork.*")
def test_a_forked_process_goes_on_alone() -> None:
    crew, counts = crew_of(6, 2), np.zeros((6, 2), np.int64)
    crew.take_on(counting, counts, np.zeros(6, np.int64))
    for _ in range(10):
        crew.step()
    crew._shared.words[INSIDE + 1] = 1  # as if the other looked out just now
    context = multiprocessing.get_context("fork")
    answers = context.SimpleQueue()
    child = context.Process(target=in_a_fork, args=(crew, counts, answers))
    child.start()
    child.join(20)
    assert child.exitcode == 0
    assert answers.get() == [11] * 6
    crew.close()
