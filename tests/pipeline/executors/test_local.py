from __future__ import annotations

import os
import signal
import time

import numpy as np
import pytest

from pipeline.executors.local import Failure, Limits, run

LIMITS = Limits(seconds=1.0, memory=2 * 2**30)


def behave(word: str) -> str:
    """Do as told."""
    if word == "sleep":
        time.sleep(60)
    if word == "segfault":
        os.kill(os.getpid(), signal.SIGSEGV)
    if word == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if word == "allocate":
        return str(np.ones(2**30).sum())
    if word == "raise":
        raise ValueError("as told")
    return word.upper()


def threads(name: str) -> str | None:
    return os.environ.get(name)


@pytest.mark.parametrize("workers", [1, 2])
def test_an_item_that_fails_takes_no_other_with_it(workers: int) -> None:
    words = ["a", "sleep", "b", "segfault", "c", "kill", "d", "allocate", "e", "raise", "f"]
    found = dict(run(behave, words, workers=workers, limits=LIMITS))
    assert [found[word] for word in "abcdef"] == list("ABCDEF")
    kinds = {word: result.kind for word, result in found.items() if isinstance(result, Failure)}
    assert kinds == {"sleep": "timeout", "segfault": "died", "kill": "killed", "allocate": "memory", "raise": "raised"}
    assert found["raise"] == Failure("raised", "ValueError: as told")


def test_one_worker_gives_results_in_the_order_of_the_items_however_late_they_are_asked_for() -> None:
    words = [f"word {i}" for i in range(8)]
    results = run(behave, words, workers=1, limits=LIMITS)
    found = [next(results)[0]]
    time.sleep(0.3)  # the others end meanwhile, all of them before anybody looks
    found += [word for word, _ in results]
    assert found == words


def test_workers_compute_with_one_thread_and_the_caller_keeps_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    assert dict(run(threads, ["OMP_NUM_THREADS"], workers=1, limits=LIMITS)) == {"OMP_NUM_THREADS": "1"}
    assert "OMP_NUM_THREADS" not in os.environ


def test_an_item_costs_less_than_a_millisecond() -> None:
    list(run(behave, ["warm"], workers=2, limits=LIMITS))
    start = time.perf_counter()
    assert len(list(run(behave, ["x"] * 2000, workers=2, limits=LIMITS))) == 2000
    assert (time.perf_counter() - start) / 2000 < 0.001


def test_leaving_early_stops_the_workers() -> None:
    results = run(behave, ["a", *["sleep"] * 50], workers=1, limits=Limits(60.0, 2**31))
    start = time.perf_counter()
    assert next(iter(results)) == ("a", "A")
    results.close()  # type: ignore[attr-defined]
    assert time.perf_counter() - start < 10.0
