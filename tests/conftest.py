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


@pytest.fixture(scope="session", autouse=True)
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Tests, and the commands that they run, leave the user's cache alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOUSEEXPO_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
