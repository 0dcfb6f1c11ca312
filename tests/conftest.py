"""Options of the whole suite."""

from __future__ import annotations

import gc
import os
import re
import sys
from collections.abc import Generator, Iterator
from multiprocessing import forkserver
from pathlib import Path
from typing import Any, Final

import pytest

from tests.builders.tries import set_share

QUICK: Final = "not slow"
"""What ``make test`` selects."""

ALL_SLOW: Final = re.compile(r"^pytestmark = (\[\s*)?pytest\.mark\.slow\b", re.MULTILINE)
SIMULATOR: Final = "tests/houseexpo/pseudoslam/"
KERNELS_TOO: Final = (
    *("tests/houseexpo/commands/", "tests/houseexpo/service/", "tests/test_"),
    *("tests/properties/test_obstacle_properties", "tests/properties/test_pseudoslam_properties"),
)
OF_WORKERS: Final = (
    "tests.builders.batch",
    "pipeline.sources.mesh_file",
    "pipeline.sources.generated",
    "pipeline.sources.reader_choice",
)
PASSED: Final[list[str]] = []
STANDS_FOR: Final = dict.fromkeys(
    ("step_pool_by_sector", "step_pool_by_rays", "step_pool_in_full"), "step_pool_with_people"
)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--benchmarks", action="store_true", help="run tests/benchmarks too, and print what they measure")
    parser.addoption("--note-passed", type=Path, metavar="FILE", help="write the names of the tests that pass")
    parser.addoption(
        "--leave-out", type=Path, metavar="FILE", help="leave out those of FILE that a quick run tries whole"
    )
    parser.addoption("--tries", type=float, metavar="N", help="try properties on N times as many examples")
    kit = parser.getgroup("kinds", "houses of each kind (tests/benchmarks/test_bench_kinds.py)")
    kit.addoption("--members", type=int, default=100, help="how many houses of each kind")
    kit.addoption("--kinds", default="", help="which kinds, separated by commas; all by default")
    kit.addoption("--seed", type=int, default=0, help="another seed gives other houses")
    kit.addoption("--keep", default="", metavar="DIR", help="write houses that fail, and their plans")


def pytest_configure(config: pytest.Config) -> None:
    """Keep bytecode, whatever the environment says: to compile the tests takes two thirds of a collection."""
    sys.dont_write_bytecode = False
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    set_share(config.option.tries or (0.5 if config.option.markexpr == QUICK else 1.0))


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave files that have no quick test out of the quick run: to read them takes seconds."""
    if config.option.markexpr != QUICK:
        return None
    if "benchmarks" in collection_path.parts and not config.option.benchmarks:
        return True
    if not collection_path.name.startswith("test_"):
        return None
    return True if ALL_SLOW.search(collection_path.read_text()) else None


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without looking for garbage, of which there is little: it takes a third of the time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Let every second worker read the files from the last to the first.

    All workers read all files. The first time, reading a file means compiling it, and what another worker has compiled
    is only loaded. ``pytest_collection_modifyitems`` gives all workers the same order.
    """
    report = yield
    if isinstance(collector, pytest.Directory) and _worker_number(collector.config) % 2:
        report.result.reverse()
    return report


def _worker_number(config: pytest.Config) -> int:
    """Return the number in the name of this worker, ``gw0`` and so on; 0 where there are no workers."""
    return int(config.workerinput["workerid"].removeprefix("gw")) if hasattr(config, "workerinput") else 0


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Where several workers run, put the simulator's tests first, and last what needs its kernels too.

    By then, the worker with the simulator's tests has compiled them. Otherwise files are in the order of their names.
    """
    if config.option.leave_out:
        passed = set(config.option.leave_out.read_text().splitlines())
        left = {item for item in items if item.nodeid in passed and _is_whole_in_quick_run(item)}
        config.hook.pytest_deselected(items=list(left))
        items[:] = [item for item in items if item not in left]
    if hasattr(config, "workerinput"):
        items.sort(key=_place_of_file)


def _is_whole_in_quick_run(item: pytest.Item) -> bool:
    """Return whether a quick run tries all of a test: with the true kernels, and with each example of a property."""
    return not item.nodeid.startswith((SIMULATOR, *KERNELS_TOO)) and not hasattr(item.obj, "is_hypothesis_test")  # type: ignore[attr-defined]


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Remember what has passed, for ``--note-passed``."""
    if report.when == "call" and report.passed:
        PASSED.append(report.nodeid)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write what has passed, if that is asked for, where all reports are."""
    if session.config.option.note_passed and not hasattr(session.config, "workerinput"):
        session.config.option.note_passed.write_text("".join(f"{name}\n" for name in PASSED))


def _place_of_file(item: pytest.Item) -> tuple[int, str]:
    file = item.nodeid.partition("::")[0]
    return file.startswith(KERNELS_TOO) - file.startswith(SIMULATOR), file


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give all tests of the simulator to one of two workers: both would compile the same kernels, each for itself."""
    from xdist.scheduler import LoadFileScheduling
    from xdist.workermanage import parse_tx_spec_config

    if config.option.markexpr != QUICK or len(parse_tx_spec_config(config)) != 2:
        return None

    class SimulatorApart(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return SIMULATOR if nodeid.startswith(SIMULATOR) else super()._split_scope(nodeid)

    config.option.loadscopereorder = False  # keep the order of the tests
    return SimulatorApart(config, log)


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Tests, and the commands that they run, leave the user's cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOUSEEXPO_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session", autouse=True)
def _workers_share_imports() -> Iterator[None]:
    """Let the fork server of builds import what the workers of small builds need, once for all of them.

    Otherwise each worker imports the readers, and the planner's module with pytest: half a second for each of hundreds.
    """
    true = forkserver.set_forkserver_preload
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(forkserver, "set_forkserver_preload", lambda names: true([*names, *OF_WORKERS]))
        yield


@pytest.fixture(scope="session", autouse=True)
def _one_kernel_for_all_noise(pytestconfig: pytest.Config) -> Iterator[None]:
    """Let the kernel of a step that can do everything stand in, in the quick run, for three that can do less.

    Each of these compiles the same functions once more, for a quarter of a minute; the whole run tests each.
    """
    if pytestconfig.option.markexpr != QUICK:
        yield
        return
    from houseexpo.pseudoslam import step_kernels

    true = step_kernels.find_kernel
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(step_kernels, "find_kernel", lambda name: true(STANDS_FOR.get(name, name)))
        yield
