"""Docstrings describe what is there: each parameter that one lists is a parameter, or an attribute of the class."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted(file for package in ("houseexpo", "pipeline", "stats") for file in (ROOT / package).rglob("*.py"))
SECTION = re.compile(r"^(?:Parameters|Attributes)\n-+\n(.*?)(?=^\w[^\n]*\n-{3,}|\Z)", re.DOTALL | re.MULTILINE)


def described(node: ast.AST) -> Iterator[str]:
    """Yield the names that a docstring lists."""
    found = SECTION.search(ast.get_docstring(node) or "")  # type: ignore[arg-type]  # a class or a function
    for line in found[1].splitlines() if found else ():
        names = line.partition(" : ")[0]
        if re.fullmatch(r"[\w*]+(, [\w*]+)*", names):
            yield from (name.strip("* ") for name in names.split(","))


def known(node: ast.AST) -> set[str]:
    """Return the parameters of a function; of a class its fields, its methods, and what they set and take."""
    names = {part.arg for part in ast.walk(node) if isinstance(part, ast.arg)}
    if isinstance(node, ast.ClassDef):
        names |= {part.target.id for part in node.body if isinstance(part, ast.AnnAssign)}  # type: ignore[union-attr]
        names |= {part.name for part in node.body if isinstance(part, ast.FunctionDef)}
        names |= {part.attr for part in ast.walk(node) if isinstance(part, ast.Attribute)}
    return names


@pytest.mark.parametrize("package", ["houseexpo", "pipeline", "stats"])
def test_every_parameter_that_a_docstring_lists_is_there(package: str) -> None:
    wrong = [
        f"{file.relative_to(ROOT)}:{node.lineno}: {name}"
        for file in FILES
        if file.is_relative_to(ROOT / package)
        if "----\n" in (text := file.read_text(encoding="utf-8"))  # it underlines a list
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        if (names := list(described(node)))
        for name in set(names) - known(node)
    ]
    assert wrong == []
