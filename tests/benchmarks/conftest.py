"""Benchmarks measure; they run only where asked for (``make bench``), and print the rows of docs/benchmarks.md."""

from __future__ import annotations

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--benchmarks"):
        return
    skip = pytest.mark.skip(reason="a benchmark: make bench")
    for item in items:
        if "benchmarks" in item.path.parts:
            item.add_marker(skip)
