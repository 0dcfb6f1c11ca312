"""Whether places of the code and tests that pages name exist; the files are read, and none is imported."""

from __future__ import annotations

import ast
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def is_code(place: str) -> bool:
    """Whether ``module:name`` or ``module:name.name`` is there; a package may import the name from elsewhere."""
    module, _, name = place.partition(":")
    file = ROOT / (module.replace(".", "/") + ".py")
    file = file if file.is_file() else file.with_suffix("") / "__init__.py"
    return file.is_file() and name in _names(file)


def is_test(name: str) -> bool:
    """Whether ``file::test`` or ``file::class::test`` is there."""
    file, _, test = name.partition("::")
    return (ROOT / file).is_file() and test.replace("::", ".") in _names(ROOT / file)


@lru_cache
def _names(file: Path) -> frozenset[str]:
    """The names that a module defines or imports, and those that its classes define."""
    found: set[str] = set()
    _collect(ast.parse(file.read_text()).body, "", found)
    return frozenset(found)


def _collect(body: list[ast.stmt], before: str, found: set[str]) -> None:
    for each in body:
        if isinstance(each, ast.FunctionDef | ast.ClassDef):
            found.add(before + each.name)
        if isinstance(each, ast.ClassDef):
            _collect(each.body, f"{before}{each.name}.", found)
        if isinstance(each, ast.Assign):
            found.update(before + target.id for target in each.targets if isinstance(target, ast.Name))
        if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name):
            found.add(before + each.target.id)
        if isinstance(each, ast.ImportFrom):
            found.update(before + (name.asname or name.name) for name in each.names)
