"""The examples in the docstrings are true."""

from __future__ import annotations

import doctest
import pkgutil
from importlib import import_module

import pytest

import houseexpo

MODULES = sorted(found.name for found in pkgutil.iter_modules(houseexpo.__path__) if not found.ispkg)


@pytest.mark.parametrize("name", MODULES)
def test_examples(name):
    if name == "__main__":
        pytest.skip("runs the command")
    failed, _ = doctest.testmod(import_module(f"houseexpo.{name}"))
    assert failed == 0
