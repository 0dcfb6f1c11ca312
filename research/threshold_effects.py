"""Move each number of ``pipeline.stages`` and ``pipeline.geometry`` alone, and count the plans that change.

::

    python -m research.threshold_effects --members 3 --files ../shared/data/wild/*.glb --records effects.jsonl

A number is a constant of a module. It is moved by a fifth either way, and to nothing and a thousandfold, which switches
its rule off. A level is planned again only where it runs a line that reads the number, from the level as its
reader gave it: what readers do with the number is not seen. Without ``--all`` a number is moved no further once a plan
has changed. What changes no plan at any factor decides nothing in these houses: its rule may go. Times are of the
processor, so that a busy machine gives the same table.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import hashlib
import importlib
import multiprocessing
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import CodeType, FrameType, ModuleType
from typing import Any

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

import pipeline
from houseexpo.errors import HouseExpoError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from pipeline.algorithm import plan_level
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.values import Level
from research.confidence_fit import levels_of
from tests.builders.kinds.registry import KINDS, RAW, make_member

PACKAGES = ("stages", "geometry")
FACTORS = (0.0, 1000.0, 0.8, 1.2)
"""The first two mostly change something at once, so that most numbers are done early."""
LONGEST_S = 4
"""A level that takes longer than this to plan, each line watched, is left out."""
SLOWER = 2
"""A plan that takes so many times as long, beside one whose lines were watched, counts as changed."""
QUICKEST = 3
"""Of the levels that read a number, so many are planned at all factors before any other is."""
MEMORY = 6 << 30
Place = tuple[str, int]


class Number(msgspec.Struct, frozen=True):
    """A constant: its module, its name, and the lines (module, line) that read it, none where a module's body does."""

    module: str
    name: str
    lines: frozenset[Place] | None = None

    @property
    def title(self) -> str:
        """The constant as a person names it."""
        return f"{self.module.removeprefix('pipeline.')}.{self.name}"


class Effect(msgspec.Struct, frozen=True):
    """How many plans, of ``read`` that read the number, changed at each factor, and the first that did."""

    number: str
    value: str
    read: int
    changed: dict[str, int]
    first: str = ""


class Planned(msgspec.Struct, frozen=True):
    """The plans of a level as a hash, the seconds they took, and the lines that ran."""

    digest: str
    seconds: float
    lines: frozenset[Place] = frozenset()


def numbers() -> list[Number]:
    """Return every numeric constant of the packages with the lines that read it, under whatever name."""
    root = Path(pipeline.__file__).parent
    paths = sorted(path for package in PACKAGES for path in (root / package).glob("*.py"))
    trees = {f"pipeline.{path.parent.name}.{path.stem}": ast.parse(path.read_text()) for path in paths}
    reads = {module: lines_of(tree, module) for module, tree in trees.items()}
    imported: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for here, tree in trees.items():
        for node in tree.body:
            for alias in node.names if isinstance(node, ast.ImportFrom) else ():
                imported.setdefault((str(node.module), alias.name), []).append((here, alias.asname or alias.name))
    found = []
    for module, tree in trees.items():
        for name in constants_of(tree):
            places = [(module, name), *imported.get((module, name), [])]
            read = [reads[here].get(known, frozenset()) for here, known in places]
            found.append(
                Number(module, name, None if None in read else frozenset(at for each in read for at in each or ()))
            )
    return found


def constants_of(tree: ast.Module) -> Iterator[str]:
    """Yield the names that a module's body binds to numbers, or to tuples of numbers."""
    for statement in tree.body:
        targets = statement.targets if isinstance(statement, ast.Assign) else []
        if isinstance(statement, ast.AnnAssign) and statement.value is not None:
            targets = [statement.target]
        for target in targets:
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            yield from (n.id for n in names if isinstance(n, ast.Name) and is_numeric(statement.value))


def is_numeric(node: ast.AST | None) -> bool:
    """Return whether an expression is of numbers and calls on numbers only."""
    match node:
        case ast.Constant():
            return isinstance(node.value, int | float) and not isinstance(node.value, bool)
        case ast.UnaryOp():
            return is_numeric(node.operand)
        case ast.BinOp():
            return is_numeric(node.left) and is_numeric(node.right)
        case ast.Tuple() | ast.List():
            return bool(node.elts) and all(map(is_numeric, node.elts))
        case ast.Call():
            return bool(node.args) and all(map(is_numeric, node.args))
    return False


def lines_of(tree: ast.Module, module: str) -> dict[str, frozenset[Place] | None]:
    """Return for each name the lines that read it; None for a name that the module's own body reads.

    A default of an argument is read by all lines of its function.
    """
    found: dict[str, set[Place]] = {}
    body: set[str] = set()
    for statement in tree.body:
        inner = isinstance(statement, ast.FunctionDef)
        defaults = [*statement.args.defaults, *statement.args.kw_defaults] if inner else []
        given = {node.id for each in defaults for node in walk(each) if isinstance(node, ast.Name)}
        nodes = walk(statement)
        lines = {(module, node.lineno) for node in nodes}
        for node in nodes:
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                found.setdefault(node.id, set()).update(lines if node.id in given else {(module, node.lineno)})
                if not isinstance(statement, ast.FunctionDef | ast.ClassDef):
                    body.add(node.id)
    return {name: None if name in body else frozenset(lines) for name, lines in found.items()}


def walk(node: ast.AST | None) -> list[Any]:
    """Return the nodes of an expression or a function that stand in a line."""
    return [] if node is None else [each for each in ast.walk(node) if hasattr(each, "lineno")]


@contextlib.contextmanager
def moved(number: Number, factor: float) -> Iterator[None]:
    """Multiply a constant wherever it is known, also as an argument's default; a whole number moves by one at least."""
    old = getattr(sys.modules[number.module], number.name)
    new = times(old, factor)
    places: list[tuple[ModuleType, str, Any]] = []
    for module in [m for n, m in sys.modules.items() if n.startswith("pipeline.")]:
        for key, value in vars(module).items():
            if key == number.name and value is old:
                places.append((module, key, value))
    functions = [f for m in {p[0] for p in places} for f in vars(m).values() if hasattr(f, "__defaults__")]
    before = [(f, f.__defaults__, f.__kwdefaults__) for f in functions]
    try:
        for module, key, _ in places:
            setattr(module, key, new)
        for function, defaults, by_name in before:
            if defaults and any(value is old for value in defaults):
                function.__defaults__ = tuple(new if value is old else value for value in defaults)
            if by_name and any(value is old for value in by_name.values()):
                function.__kwdefaults__ = {k: new if value is old else value for k, value in by_name.items()}
        yield
    finally:
        for module, key, value in places:
            setattr(module, key, value)
        for function, defaults, by_name in before:
            function.__defaults__, function.__kwdefaults__ = defaults, by_name


def times(value: Any, factor: float) -> Any:
    """Return a number, a tuple of numbers or an array times a factor."""
    if isinstance(value, tuple):
        return tuple(times(each, factor) for each in value)
    if isinstance(value, int):
        step = round(value * factor) - value
        return value + (step or (1 if factor > 1 else -1))
    return value * factor


def plan(level: Level) -> str:
    """Return a hash of a level's plans, or of why there are none."""
    try:
        made = plan_level(level, PipelineConfig(), np.random.default_rng(0))
    except Rejection as rejection:
        return str(rejection.reason)
    texts = [encode(each) if isinstance(each, FloorPlan) else str(each.rejection.reason).encode() for each in made]
    return hashlib.sha256(b"".join(texts)).hexdigest()


def first_plan(level: Level) -> Planned | None:
    """Plan a level, watching the lines that it runs; None where it takes too long or fails."""
    ran: set[Place] = set()

    def calls(frame: FrameType, *_: object) -> Any:
        return lines if module_of(frame.f_code) else None

    def lines(frame: FrameType, event: str, _: object) -> Any:
        if event == "line":
            ran.add((module_of(frame.f_code), frame.f_lineno))
        return lines

    try:
        with at_most(LONGEST_S):
            start = time.process_time()
            sys.settrace(calls)
            digest = plan(level)
            seconds = time.process_time() - start
    except (TimeoutError, MemoryError, ValueError, HouseExpoError):
        return None
    finally:
        sys.settrace(None)
    return Planned(digest, seconds, frozenset(ran))


MODULES: dict[str, str] = {}


def module_of(code: CodeType) -> str:
    """Return the module of the packages that a piece of code stands in, or ""."""
    file = code.co_filename
    if file not in MODULES:
        path = Path(file)
        ours = path.parent.name in PACKAGES and path.parent.parent.name == "pipeline"
        MODULES[file] = f"pipeline.{path.parent.name}.{path.stem}" if ours else ""
    return MODULES[file]


@contextlib.contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in what takes longer."""

    def late(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)


HOUSES: dict[str, Level] = {}
BEFORE: dict[str, Planned] = {}
"""What every worker inherits as a copy of the process that read the houses."""


def effect_of(number: Number, most: int, *, every: bool) -> Effect:
    """Count the plans that change, of ``most`` at most; without ``every``, up to the first."""
    read = [name for name, b in BEFORE.items() if number.lines is None or number.lines & b.lines]
    read.sort(key=lambda name: BEFORE[name].seconds)
    changed: dict[str, int] = {}
    first = ""
    for some in (read[:QUICKEST], read[QUICKEST:most]):
        for factor in FACTORS:
            with moved(number, factor):
                for name in some:
                    if (every or not changed) and changes(name):
                        changed[f"{factor:g}"] = changed.get(f"{factor:g}", 0) + 1
                        first = first or f"{name} x {factor:g}"
    value = str(getattr(sys.modules[number.module], number.name)).replace("\n", " ")
    return Effect(number.title, value, len(read), changed, first)


def changes(name: str) -> bool:
    """Plan a house again; what fails, or takes far longer, has changed."""
    try:
        with at_most(SLOWER * BEFORE[name].seconds + 2):
            return plan(HOUSES[name]) != BEFORE[name].digest
    except Exception:  # noqa: BLE001 (whatever goes wrong, it did not before)
        return True


def houses(kinds: Sequence[str], members: int, seed: int, files: Sequence[Path]) -> Iterator[tuple[str, Level]]:
    """Yield the levels of made houses and of files, each with a name."""
    with tempfile.TemporaryDirectory() as folder:
        for kind in kinds:
            for number in range(members):
                path = make_member(kind, number, seed, Path(folder) / kind).path
                yield from ((f"{kind} {number}.{k}", level) for k, level in enumerate(levels_of(path)))
    for path in files:
        with contextlib.suppress(HouseExpoError, TimeoutError, MemoryError), at_most(60):
            yield from ((f"{path.name}.{k}", level) for k, level in enumerate(levels_of(path)))


def _worker(task: tuple[Number, int, bool]) -> Effect:
    return effect_of(task[0], task[1], every=task[2])


def _of_house(name: str) -> tuple[str, Planned | None]:
    return name, first_plan(HOUSES[name])


def table_of(effects: Sequence[Effect]) -> Table:
    """A row a number, those that change least first."""
    table = Table(title=f"What {len(effects)} numbers change")
    for k, heading in enumerate(("number", "value", "plans that read it", *(f"x {f:g}" for f in FACTORS), "first")):
        table.add_column(heading, justify="right" if 2 <= k < 3 + len(FACTORS) else "left")
    for effect in sorted(effects, key=lambda e: (sum(e.changed.values()), e.read, e.number)):
        counts = [str(effect.changed.get(f"{f:g}", "")) for f in FACTORS]
        table.add_row(effect.number, effect.value, str(effect.read), *counts, effect.first)
    return table


def main() -> None:
    """Print the table, and keep it as JSON lines."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--members", type=int, default=3)
    parser.add_argument("--kinds", default=",".join({**KINDS, **RAW}))
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--files", nargs="*", type=Path, default=[])
    parser.add_argument("--only", help="numbers whose name holds this text; a comma parts several")
    parser.add_argument("--most", type=int, default=10_000, help="of the levels that read a number, so many at most")
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--records", type=Path)
    given = parser.parse_args()
    HOUSES.update(houses(given.kinds.split(","), given.members, given.seed, given.files))
    for package in PACKAGES:
        for path in sorted((Path(pipeline.__file__).parent / package).glob("*.py")):
            importlib.import_module(f"pipeline.{package}.{path.stem}")
    wanted = [n for n in numbers() if not given.only or any(text in n.title for text in given.only.split(","))]
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    fork = multiprocessing.get_context("fork")
    console = Console(width=180)
    with fork.Pool(2) as pool:
        BEFORE.update({name: found for name, found in pool.imap(_of_house, HOUSES) if found})
    console.print(f"{len(BEFORE)} of {len(HOUSES)} levels, {sum(b.seconds for b in BEFORE.values()):.0f} s")
    effects = []
    with fork.Pool(2, maxtasksperchild=8) as pool:
        for effect in pool.imap_unordered(_worker, [(number, given.most, given.all) for number in wanted]):
            effects.append(effect)
            if given.records:
                with given.records.open("ab") as stream:
                    stream.write(msgspec.json.encode(effect) + b"\n")
    console.print(table_of(effects))


if __name__ == "__main__":
    main()
