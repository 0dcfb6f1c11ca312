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

from houseexpo.pseudoslam.envs.thread_pool import ThreadPool
from houseexpo.pseudoslam.kernels.runtime.thread_pool import (
    FAILED,
    FINISHING,
    INSIDE,
    LAG,
    MAX_ENVS,
    done,
    enter,
    leave,
    new_sync,
    outstanding,
    puts_off,
    take,
    untaken,
)

compiled_only = pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="words are no atoms in Python")


@njit(nogil=True)
def counting(counts: np.ndarray, by: np.ndarray, scratch: int, sync: np.ndarray, epoch: int, thread: int) -> None:
    """Count how often each one is taken, and its view drawn, and note by whom; each takes some time."""
    enter(sync, thread)
    while True:
        taken = take(sync, epoch, thread)
        if taken < 0:
            break
        i, is_moved = taken & MAX_ENVS, taken <= MAX_ENVS
        for _ in range(300):
            counts[i, 1] = (counts[i, 1] * 31 + 7) % 1009
        if is_moved:
            counts[i, 0] += 1
            by[i] = thread
        if not (is_moved and puts_off(sync, i)):
            counts[i, 2] += 1
        done(sync, taken)
    leave(sync, thread)


def crew_of(number: int, threads: int) -> ThreadPool:
    return ThreadPool(number, [0] * threads)  # type: ignore[list-item]  # no scratch is needed here


def counting_crew(number: int, threads: int) -> tuple[ThreadPool, np.ndarray]:
    """A crew that counts, and what it counts (number, 3): steps, anything, views."""
    sync, counts = crew_of(number, threads), np.zeros((number, 3), np.int64)
    sync.take_on(counting, counts, np.zeros(number, np.int64))
    return sync, counts


def wait_for(true: Any) -> None:
    """Return when something comes true; fail after ten seconds."""
    end = time.monotonic() + 10.0
    while not (is_true := true()) and time.monotonic() < end:
        time.sleep(0.001)
    assert is_true


def test_alone_one_takes_all_from_the_first_on() -> None:
    sync, order = new_sync(5, 1), np.zeros((5, 3), np.int64)
    for k in range(1, 4):
        counting(order, np.full(5, 9), 0, sync, 0, 0)
        assert (order[:, [0, 2]] == k).all()
        assert not outstanding(sync)


@compiled_only
@pytest.mark.parametrize(("number", "threads"), [(1, 2), (2, 3), (7, 2), (64, 3)])
def test_each_is_taken_once_a_step(number: int, threads: int) -> None:
    sync = crew_of(number, threads)
    counts, by, seen = np.zeros((number, 3), np.int64), np.zeros(number, np.int64), set()
    sync.take_on(counting, counts, by)
    for k in range(1, 2001):
        sync.step()
        assert (counts[:, 0] == k).all()
        seen |= set(by.tolist())
        sync.finish()
        assert (counts[:, 2] == k).all()
        if k % 500 == 0:  # once they sleep
            time.sleep(0.01)

    def somebody_helps() -> bool:
        sync.step()
        sync.finish()
        seen.update(by.tolist())
        return number == 1 or len(seen) > 1

    wait_for(somebody_helps)
    sync.close()


@compiled_only
def test_arrays_change_between_two_steps() -> None:
    """Who looks out for a step of the old ones leaves; nothing is written where nothing is read any more."""
    sync, expected = crew_of(9, 3), np.zeros(9, np.int64)
    for _ in range(300):
        counts = np.zeros((9, 3), np.int64)
        sync.take_on(counting, counts, np.zeros(9, np.int64))
        for k in range(1, 4):
            sync.step()
            sync.finish()
            assert (counts[:, [0, 2]] == k).all()
        expected += counts[:, 0]
    assert (expected == 900).all()
    sync.close()


def test_the_last_views_are_put_off() -> None:
    """Here nobody draws them before the leader comes back for them."""
    sync, counts = new_sync(5, 1, lag=2), np.zeros((5, 3), np.int64)
    for k in range(1, 4):
        counting(counts, np.zeros(5, np.int64), 0, sync, 0, 0)
        assert counts[:, 0].tolist() == [k] * 5
        assert counts[:, 2].tolist() == [k, k, k, k - 1, k - 1]
        assert outstanding(sync) == FINISHING
        counting(counts, np.zeros(5, np.int64), 0, sync, 0, FINISHING)
        assert counts[:, 2].tolist() == [k] * 5
        assert not outstanding(sync)


@compiled_only
def test_others_draw_views_while_the_leader_is_away() -> None:
    sync, counts = counting_crew(40, 2)
    assert 0 < sync._shared.words[LAG] < 40
    steps = 0

    def nobody_else_can_have_drawn_them() -> bool:
        nonlocal steps
        sync.step()
        steps += 1
        end = time.monotonic() + 0.05  # the other may have fallen asleep just before
        while outstanding(sync._shared.words) and time.monotonic() < end:
            time.sleep(0.0)
        by_others = not outstanding(sync._shared.words)
        sync.finish()
        assert (counts[:, [0, 2]] == steps).all()
        return by_others

    for _ in range(20):
        wait_for(nobody_else_can_have_drawn_them)
    sync.close()


@compiled_only
def test_the_leader_may_do_something_else_until_half_is_taken() -> None:
    (sync, counts), left = counting_crew(40, 2), []

    def work() -> bool:
        left.append(untaken(sync._shared.words))
        return len(left) % 3 != 0

    for k in range(1, 200):
        before = len(left)
        sync.step(meanwhile=work)
        sync.finish()
        assert (counts[:, [0, 2]] == k).all()
        assert len(left) - before <= 3
    assert len(left) > 50
    alone, _ = counting_crew(4, 1)
    alone.step(meanwhile=lambda: pytest.fail("alone there is no time for anything else"))
    sync.close()


@compiled_only
def test_who_sleeps_is_woken_while_the_leader_does_something_else() -> None:
    sync, counts = counting_crew(40, 2)

    def work_without_end() -> bool:
        time.sleep(0.0005)
        return True

    for k in range(1, 20):
        time.sleep(0.005 * (k % 3))  # it looks out for half a millisecond
        sync.step(meanwhile=work_without_end)
        sync.finish()
        assert (counts[:, [0, 2]] == k).all()
    sync.close()


@compiled_only
def test_a_leader_who_is_interrupted_meanwhile_leaves_nothing_half_done() -> None:
    sync, counts = counting_crew(40, 2)

    def interrupted() -> bool:
        raise KeyboardInterrupt

    for k in range(1, 50):
        with contextlib.suppress(KeyboardInterrupt):
            sync.step(meanwhile=interrupted)
        sync.finish()
        assert (counts[:, [0, 2]] == k).all()
    sync._lead = lambda _: None  # type: ignore[method-assign]  # interrupted once more, before it rejoins
    sync.step(meanwhile=lambda: False)
    del sync._lead
    sync.finish()
    assert (counts[:, [0, 2]] == 50).all()
    sync.close()


def test_threads_end_with_their_crew() -> None:
    before = set(threading.enumerate())
    sync, other = crew_of(4, 3), crew_of(4, 2)
    first, second, third = sorted(set(threading.enumerate()) - before, key=lambda thread: thread.ident or 0)
    assert all(thread.daemon for thread in (first, second, third))
    sync.close()
    sync.close()
    wait_for(lambda: sum(thread.is_alive() for thread in (first, second, third)) == 1)
    del other
    gc.collect()
    wait_for(lambda: not any(thread.is_alive() for thread in (first, second, third)))


def test_a_thread_that_fails_is_heard_of() -> None:
    def failing(*arguments: Any) -> None:
        if arguments[-1] > 0:
            raise MemoryError("no room")

    sync = crew_of(4, 2)
    sync.take_on(failing)
    with contextlib.suppress(RuntimeError):  # it may have failed by the end of this one
        sync.step()
    wait_for(lambda: sync._shared.words[FAILED])
    with pytest.raises(RuntimeError, match="has failed; make another") as caught:
        sync.step()
    assert isinstance(caught.value.__cause__, MemoryError)


def test_an_interrupted_step_is_not_the_last() -> None:
    sync, steps = crew_of(4, 1), []

    def interrupted_once(*_: Any) -> None:
        steps.append(1)
        if len(steps) == 1:
            raise KeyboardInterrupt

    sync.take_on(interrupted_once)
    with pytest.raises(KeyboardInterrupt):
        sync.step()
    sync.step()
    assert len(steps) == 2


def in_a_fork(sync: ThreadPool, counts: np.ndarray, answers: Any) -> None:
    sync.step()
    sync.finish()
    answers.put(counts[:, [0, 2]].ravel().tolist())


@compiled_only
@pytest.mark.filterwarnings("ignore:.*fork.*")
def test_a_forked_process_goes_on_alone() -> None:
    sync, counts = counting_crew(6, 2)
    for _ in range(10):
        sync.step()
        sync.finish()
    sync._shared.words[INSIDE + 1] = 1  # as if the other looked out just now
    context = multiprocessing.get_context("fork")
    answers = context.SimpleQueue()
    child = context.Process(target=in_a_fork, args=(sync, counts, answers))
    child.start()
    child.join(20)
    assert child.exitcode == 0
    assert answers.get() == [11] * 12
    sync.close()
