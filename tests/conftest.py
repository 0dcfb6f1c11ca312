"""Options of the whole suite."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--benchmarks", action="store_true", help="run tests/benchmarks too, and print what they measure")
    kit = parser.getgroup("kinds", "houses of each kind (tests/benchmarks/test_bench_kinds.py)")
    kit.addoption("--members", type=int, default=100, help="how many houses of each kind")
    kit.addoption("--kinds", default="", help="which kinds, separated by commas; all by default")
    kit.addoption("--seed", type=int, default=0, help="another seed gives other houses")
    kit.addoption("--keep", default="", metavar="DIR", help="write houses that fail, plans and pictures")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Where several workers run, alternate the simulator's modules with the others.

    Two workers that begin modules of the simulator at the same time compile the same kernels, each for itself. One that
    begins later finds them on disk.
    """
    if not hasattr(config, "workerinput"):
        return
    modules = dict.fromkeys(item.path for item in items)
    simulator = [path for path in modules if "pseudoslam" in path.parts]
    others = [path for path in modules if "pseudoslam" not in path.parts]
    place = {path: (k + 0.5) / len(group) for group in (simulator, others) for k, path in enumerate(group)}
    items.sort(key=lambda item: place[item.path])


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Tests, and the commands that they run, leave the user's cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOUSEEXPO_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
