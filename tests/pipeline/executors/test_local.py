from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from houseexpo.errors import HouseExpoError
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


def parent_with(name: str) -> str:
    """Return the number of this process's parent, and whether a module is loaded."""
    return f"{os.getppid()} {name in sys.modules}"


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


def sleep_beside(path: str) -> str:
    """Note which process this is, and that it has slept to its end; but for the path "a", which is back at once."""
    if path != "a":
        Path(path).write_text(str(os.getpid()))
        time.sleep(60)
        Path(f"{path}.ended").touch()
    return path


def test_what_workers_share_is_loaded_before_the_run_begins() -> None:
    """In a process of its own: the fork server of the tests stands already."""
    said = (
        "import os\nfrom multiprocessing import forkserver\n"
        "from tests.pipeline.executors.test_local import LIMITS, parent_with\n"
        "from pipeline.executors.local import load_ahead, run\n"
        "load_ahead(['colorsys'])\nserver = forkserver._forkserver._forkserver_pid\n"
        "(_, found), = run(parent_with, ['colorsys'], workers=1, limits=LIMITS, preload=['colorsys'])\n"
        "print(server is not None and found == f'{server} True')"
    )
    done = subprocess.run([sys.executable, "-c", said], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "True"


def test_leaving_early_stops_the_workers(tmp_path: Path) -> None:
    paths = [str(tmp_path / str(i)) for i in range(50)]
    results = run(sleep_beside, ["a", *paths], workers=1, limits=Limits(600.0, 2**31))
    assert next(iter(results)) == ("a", "a")
    while not (tmp_path / "0").exists() or not (tmp_path / "0").read_text():
        time.sleep(0.01)
    results.close()  # type: ignore[attr-defined]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0"]  # the next did not start, this one did not end
    assert not psutil.pid_exists(int((tmp_path / "0").read_text()))


def compute_now_and_then(word: str) -> str:
    """Take 0.4 s of processor time and more than 1.5 s of wall clock, as on a busy machine."""
    end = time.process_time() + 0.4
    while time.process_time() < end:
        time.sleep(0.02)
        rest = time.process_time() + 0.005
        while time.process_time() < rest:
            pass
    return word


def spin(word: str) -> str:
    while word == "spin":
        pass
    return word


@pytest.mark.slow
def test_the_limit_is_processor_time_and_a_busy_machine_costs_nothing() -> None:
    began = time.monotonic()
    assert dict(run(compute_now_and_then, ["a"], workers=1, limits=LIMITS)) == {"a": "a"}
    assert time.monotonic() - began > LIMITS.seconds
    found = dict(run(spin, ["spin", "b"], workers=2, limits=LIMITS))
    assert found == {"spin": Failure("timeout", "took longer than 1 s"), "b": "b"}


def slow_at_first(folder: str) -> str:
    """Hang the first time; each call leaves a mark, and notes those that have ended before."""
    mark = Path(folder)
    if not mark.name.startswith("slow"):
        mark.touch()
        return "done"
    if not Path(f"{folder}.tried").exists():
        Path(f"{folder}.tried").touch()
        time.sleep(60)
    return str(sorted(path.name for path in mark.parent.iterdir() if not path.name.startswith("slow")))


def test_what_exceeded_a_limit_is_tried_once_more_when_all_others_have_ended(tmp_path: Path) -> None:
    items = [str(tmp_path / name) for name in ("slow_1", "a", "slow_2", "b", "c")]
    found = list(run(slow_at_first, items, workers=2, limits=LIMITS))
    assert [item for item, _ in found[-2:]] == [items[0], items[2]]
    assert {result for _, result in found[-2:]} == {"['a', 'b', 'c']"}


class Fatal:
    """Ends the process that unpickles it."""

    def __call__(self, word: str) -> str:
        return word

    def __reduce__(self) -> tuple[Callable[[int], Any], tuple[int]]:
        return os._exit, (7,)


def killed_twice(marks: str) -> str:
    """Kill the worker, but for the third time."""
    count = len(list(Path(marks).iterdir()))
    if count < 2:
        Path(marks, str(count)).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return marks


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_an_item_whose_worker_was_killed_is_tried_again_at_once(workers: int, tmp_path: Path) -> None:
    folders = [tmp_path / name for name in "abcdef"]
    for folder in folders:
        folder.mkdir()
    items = [str(folder) for folder in folders]
    found = list(run(killed_twice, items, workers=workers, limits=LIMITS))
    assert sorted(found) == [(item, item) for item in items]
    assert workers > 1 or [item for item, _ in found] == items


@pytest.mark.slow
def test_workers_and_their_server_killed_as_soon_as_they_stand_cost_nothing() -> None:
    killed: set[int] = set()
    done = threading.Event()

    def kill() -> None:
        while not done.is_set() and len(killed) < 6:
            for process in psutil.Process().children(recursive=True):
                with suppress(psutil.NoSuchProcess):
                    if process.pid not in killed and "resource_tracker" not in " ".join(process.cmdline()):
                        process.kill()
                        killed.add(process.pid)

    killer = threading.Thread(target=kill)
    killer.start()
    words = [str(i) for i in range(200)]
    found = dict(run(behave, words, workers=2, limits=LIMITS))
    done.set()
    killer.join()
    assert found == {word: word for word in words}
    assert killed


def test_workers_that_never_get_ready_end_the_run_with_an_error() -> None:
    with pytest.raises(HouseExpoError, match=r"workers cannot be started.*exit code 7"):
        list(run(Fatal(), ["a"], workers=2, limits=LIMITS))


@pytest.mark.parametrize("memory", [2**62, 10**30])
def test_a_limit_beyond_all_memory_is_none(memory: int) -> None:
    assert dict(run(behave, ["a"], workers=1, limits=Limits(1e300, memory))) == {"a": "A"}


@pytest.mark.slow
def test_workers_end_with_their_parent(tmp_path: Path) -> None:
    code = f"""
import sys
sys.path.insert(0, {str(Path.cwd())!r})
from tests.pipeline.executors.test_local import behave, LIMITS, Limits
from pipeline.executors.local import run
if __name__ == "__main__":
    list(run(behave, ["sleep"] * 4, workers=2, limits=Limits(60.0, 2**31)))
"""
    script = tmp_path / "script.py"
    script.write_text(code)
    parent = psutil.Popen([sys.executable, script])
    while len(found := parent.children(recursive=True)) < 4:  # the tracker, the server, two workers
        time.sleep(0.02)
    parent.kill()
    _, alive = psutil.wait_procs([parent, *found], timeout=10.0)
    assert not alive


@pytest.mark.skipif(sys.platform != "linux", reason="a socket's path may have another length")
def test_a_folder_for_temporary_files_that_is_too_deep_for_sockets_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deep = tmp_path / ("d" * 80)
    deep.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(deep))
    with pytest.raises(HouseExpoError, match=f"at most 75 bytes.* found {deep}; set TMPDIR"):
        list(run(behave, ["word"], workers=1, limits=LIMITS))
