"""Move each number of ``pipeline``'s stages, geometry and tolerances alone, and count the plans that change.

::

    python -m research.threshold_effects --only LAP_M,doors. --files ../shared/data/wild/*.glb --table thresholds.md

A number is a constant of a module; labels (negative whole numbers) and layouts of bits are none. It is moved by a fifth
either way, and to nothing and a thousandfold, which switches its rule off. A level is planned again only where it runs
a line that reads the number, from the level as its reader gave it: what readers do with the number is not seen.

A plan changes where its bytes do, to a centimetre. A house changes where rooms or doors come, go or turn outside, or
where the area of a room changes by more than a twentieth. What changes no plan at any factor decides nothing in these
houses: its rule may go. What changes no house at 0.8 and 1.2 may have another value near its own.

The page is written after each number, and keeps what it says of the others.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import importlib
import multiprocessing
import re
import resource
import signal
import sys
import tempfile
import textwrap
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from enum import IntEnum
from pathlib import Path
from types import CodeType, FrameType, ModuleType
from typing import Any

import msgspec
import numpy as np
from rich.console import Console

import pipeline
from houseexpo.errors import HouseExpoError
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from pipeline import algorithm
from pipeline.config import PipelineConfig
from pipeline.rejection import Rejection
from pipeline.sources import find, reader
from pipeline.values import Level, Spaces
from research.confidence_fit import levels_of
from tests.builders.kinds.registry import KINDS, RAW, make_member

PACKAGES = ("stages", "geometry")
SHARED = "pipeline.tolerances"
OFF = (1000.0, 0.0)
NEAR = (0.8, 1.2)
FACTORS = (*OFF, *NEAR)
LONGEST_S = 2.0
"""A level that takes longer than this to plan, while it is watched, is left out; ``--longest`` says another time."""
MAP_CELL_M = 0.05
"""A picture is a robot's map with cells of this size."""
SLOWER = 3
"""A plan that takes so many times as long, beside one whose lines were watched, counts as another house."""
MEMORY = 6 << 30
SAME_AREA = 0.05
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


class Result(IntEnum):
    """What a trial has changed."""

    NOTHING = 0
    PLAN = 1
    HOUSE = 2


class Trial(msgspec.Struct, frozen=True):
    """What became of a level when a number was moved."""

    number: str
    level: str
    factor: float
    result: Result


class Planned(msgspec.Struct, frozen=True):
    """A level planned once: its plans' bytes, the house that it came to, the lines that ran, and its seconds."""

    plans: list[bytes]
    house: Any
    lines: frozenset[Place]
    seconds: float


def numbers() -> list[Number]:
    """Return every numeric constant of the packages with the lines that read it, under whatever name."""
    root = Path(pipeline.__file__).parent
    paths = sorted(path for package in PACKAGES for path in (root / package).glob("*.py"))
    trees = {f"pipeline.{path.parent.name}.{path.stem}": ast.parse(path.read_text()) for path in paths}
    trees[SHARED] = ast.parse((root / "tolerances.py").read_text())
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
            yield from (n.id for n in names if isinstance(n, ast.Name) and is_threshold(statement.value))


def is_numeric(node: ast.AST | None) -> bool:
    """Return whether an expression is of numbers and calls on numbers only."""
    match node:
        case ast.Constant():
            return isinstance(node.value, int | float) and not isinstance(node.value, bool)
        case ast.UnaryOp():
            return is_numeric(node.operand)
        case ast.BinOp():
            return not isinstance(node.op, ast.LShift) and is_numeric(node.left) and is_numeric(node.right)
        case ast.Tuple() | ast.List():
            return bool(node.elts) and all(map(is_numeric, node.elts))
        case ast.Call():
            return bool(node.args) and all(map(is_numeric, node.args))
    return False


def is_threshold(node: ast.AST | None) -> bool:
    """Return whether an expression is of numbers, and no label."""
    match node:
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int())):
            return False
    return is_numeric(node)


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


def plan(level: Level) -> tuple[list[bytes], Any]:
    """Plan a level; return the bytes of its plans and the house that it came to."""
    plans: list[bytes] = []
    spaces: dict[str, Spaces] = {}
    rejected = ""
    try:
        for result in algorithm.run_stages(level, PipelineConfig(), np.random.default_rng(0)):
            if result.stage == "refine" and isinstance(result.value, Spaces):
                spaces[result.id] = result.value
            if isinstance(result.value, FloorPlan):
                plans.append(encode(result.value))
    except Rejection as rejection:
        rejected = str(rejection.reason)
    return plans, (rejected, [house_of(each) for each in spaces.values()])


def house_of(spaces: Spaces) -> tuple[list[float], int, int, int]:
    """Return the areas of rooms, sorted, in m2, and the counts of doors, entrances and cuts."""
    outer = sum(p.leads_outside for p in spaces.passages)
    cuts = sum(p.kind == "cut" for p in spaces.passages)
    return sorted(room.area for room in spaces.rooms), len(spaces.passages) - outer, outer, cuts


def are_alike(one: Any, other: Any) -> bool:
    """Return whether two houses, as ``plan`` returns them, have the same rooms and doors."""
    if one[0] != other[0] or len(one[1]) != len(other[1]):
        return False
    return all(
        a[1:] == b[1:]
        and len(a[0]) == len(b[0])
        and all(abs(p - q) <= SAME_AREA * max(p, q) for p, q in zip(a[0], b[0], strict=True))
        for a, b in zip(one[1], other[1], strict=True)
    )


def first_plan(level: Level, watched: frozenset[Place], longest_s: float = LONGEST_S) -> Planned | None:
    """Plan a level, watching the functions that hold one of these lines; None where it takes too long or fails."""
    reads: dict[CodeType, bool] = {}
    ran: set[Place] = set()

    def calls(frame: FrameType, *_: object) -> Any:
        code = frame.f_code
        if code not in reads:
            module = module_of(code)
            reads[code] = bool(module) and any((module, line) in watched for _, _, line in code.co_lines() if line)
        return lines if reads[code] else None

    def lines(frame: FrameType, event: str, _: object) -> Any:
        if event == "line":
            ran.add((module_of(frame.f_code), frame.f_lineno))
        return lines

    start = time.process_time()
    try:
        with at_most(longest_s):
            sys.settrace(calls)
            plans, house = plan(level)
    except (TimeoutError, MemoryError, ValueError, HouseExpoError):
        return None
    finally:
        sys.settrace(None)
    return Planned(plans, house, frozenset(ran), time.process_time() - start)


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


def levels_for(number: Number) -> list[str]:
    """Return the levels that read a number: the quickest of each kind first."""
    read = [name for name, known in BEFORE.items() if number.lines is None or number.lines & known.lines]
    read.sort(key=lambda name: BEFORE[name].seconds)
    kinds: defaultdict[str, list[str]] = defaultdict(list)
    for name in read:
        kinds[name.split(" ")[0]].append(name)
    return sorted(read, key=lambda name: (kinds[name.split(" ")[0]].index(name), BEFORE[name].seconds))


def try_out(number: Number, name: str, factor: float) -> Result:
    """Plan a level again with a number moved; what fails or takes far longer is another house."""
    known = BEFORE[name]
    try:
        with moved(number, factor), at_most(SLOWER * known.seconds + 1):
            plans, house = plan(HOUSES[name])
    except Exception:  # noqa: BLE001 (whatever goes wrong, it did not before)
        return Result.HOUSE
    if not are_alike(house, known.house):
        return Result.HOUSE
    return Result.NOTHING if plans == known.plans else Result.PLAN


def trials_of(number: Number, names: Sequence[str]) -> Iterator[Trial]:
    """Try a number in these levels, each in a copy of this process: what crashes there is another house."""
    fork = multiprocessing.get_context("fork")
    for name in names:
        for factor in FACTORS:
            with ProcessPoolExecutor(1, fork) as child:
                try:
                    result = child.submit(try_out, number, name, factor).result()
                except BrokenProcessPool:
                    result = Result.HOUSE
            yield Trial(number.title, name, factor, result)


def houses(kinds: Sequence[str], members: int, seed: int, files: Sequence[Path]) -> Iterator[tuple[str, Level]]:
    """Yield the levels of made houses and of files, each with a name."""
    with tempfile.TemporaryDirectory() as folder:
        for kind in kinds:
            for number in range(members):
                path = make_member(kind, number, seed, Path(folder) / kind).path
                yield from ((f"{kind} {number}.{k}", level) for k, level in enumerate(levels_of(path)))
    for path in files:
        with contextlib.suppress(Exception, TimeoutError, MemoryError), at_most(20):
            levels = map_levels(path) if path.suffix == ".png" else levels_of(path)
            yield from ((f"file{path.suffix} {path.name}.{k}", level) for k, level in enumerate(levels))


def map_levels(path: Path) -> list[Level]:
    """Return the level of a robot's map that is a picture."""
    (item,) = find(str(path), resolution=str(MAP_CELL_M))
    return [level for level in reader(item.reader).read(item) if isinstance(level, Level)]


PAGE = """\
# Thresholds of the stages

What each number of `pipeline/stages`, `pipeline/geometry` and `pipeline/tolerances.py` decides, moved alone: `python
-m research.threshold_effects --table docs/contributing/thresholds.md` wrote this after {trials:,} trials on {levels}
levels of made houses and of files. Numbers that it did not try keep the counts of an earlier run (1,457 trials on 34
levels). A number has *plans/houses/levels* at 0.8 and 1.2, then at 0 and 1000 times its value: in how many levels a
byte of the plan changed; in how many a room, a door, an entrance or a cut came or went, or a room's area changed by
more than a twentieth; and of how many levels. Values stand in the code.
"""
EFFECTS = (
    "A fifth more or less changes a house",
    "Only without it, or a thousandfold, a house changes",
    "No house changes, but bytes of plans",
    "Nothing changes",
)
MODULE = re.compile(r"^- `([\w.]+)`: (.*?)\.$", re.MULTILINE | re.DOTALL)
ROW = re.compile(r"`(\w+)` (\d+)/(\d+)/(\d+)\s(\d+)/(\d+)/(\d+)")
Counts = tuple[tuple[int, int, int], tuple[int, int, int]]


def rows_of_page(text: str) -> dict[str, Counts]:
    """Return the counts of each number of a page: (plans, houses, levels) near its value, and off it."""
    found = {}
    for module, rows in MODULE.findall(text):
        for name, *counts in ROW.findall(rows):
            near, off = (tuple(map(int, part)) for part in (counts[:3], counts[3:]))
            found[f"{module}.{name}"] = (near, off)
    return found  # type: ignore[return-value]  # the pattern has six


def page_of(trials: Sequence[Trial], wanted: Sequence[Number], earlier: Mapping[str, Counts] | None = None) -> str:
    """Return the effects as a page in Markdown, the numbers that decide most first.

    A number without a trial keeps its counts of an ``earlier`` page.
    """
    tried, kept = {t.number for t in trials}, earlier or {}
    found: dict[str, dict[str, list[str]]] = {effect: {} for effect in EFFECTS}
    for number in wanted:
        is_old = number.title in kept and number.title not in tried
        counts = kept[number.title] if is_old else (_count(trials, number, NEAR), _count(trials, number, OFF))
        near, off = ("/".join(map(str, part)) for part in counts)
        houses_near, houses_off = counts[0][1], counts[1][1]
        plans = counts[0][0] or counts[1][0]
        effect = EFFECTS[0 if houses_near else 1 if houses_off else 2 if plans else 3]
        module = number.title.removesuffix(f".{number.name}")
        found[effect].setdefault(module, []).append(f"`{number.name}` {near} {off}")
    page = PAGE.format(trials=len(trials), levels=len({t.level for t in trials}))
    for effect, modules in found.items():
        page += f"\n## {effect}\n" if modules else ""
        for module, rows in modules.items():
            page += textwrap.fill(f"- `{module}`: {', '.join(rows)}.", 120, break_on_hyphens=False) + "\n"
    return page


def _count(trials: Sequence[Trial], number: Number, factors: Sequence[float]) -> tuple[int, int, int]:
    """Return in how many levels the plan changed, in how many the house, and of how many."""
    own: dict[str, Result] = {}
    for t in trials:
        if t.number == number.title and t.factor in factors:
            own[t.level] = max(t.result, own.get(t.level, Result.NOTHING))
    return (
        sum(result >= Result.PLAN for result in own.values()),
        sum(result == Result.HOUSE for result in own.values()),
        len(own),
    )


def main() -> None:
    """Try the numbers, and write what each decides."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--members", type=int, default=2)
    parser.add_argument("--kinds", default=",".join({**KINDS, **RAW}))
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--files", nargs="*", type=Path, default=[])
    parser.add_argument("--only", help="numbers whose name holds this text; a comma parts several")
    parser.add_argument("--levels", type=int, default=4, help="in how many levels each number is tried")
    parser.add_argument("--longest", type=float, default=LONGEST_S, help="seconds that a level may take")
    parser.add_argument("--table", type=Path, required=True, help="the page to write")
    given = parser.parse_args()
    console = Console()
    for package in PACKAGES:
        for path in sorted((Path(pipeline.__file__).parent / package).glob("*.py")):
            importlib.import_module(f"pipeline.{package}.{path.stem}")
    wanted = [n for n in numbers() if not given.only or any(text in n.title for text in given.only.split(","))]
    watched = frozenset(place for number in wanted for place in number.lines or ())
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for name, level in houses(given.kinds.split(","), given.members, given.seed, given.files):
        if known := first_plan(level, watched, given.longest):
            HOUSES[name], BEFORE[name] = level, known
    console.print(f"{len(BEFORE)} levels, {sum(known.seconds for known in BEFORE.values()):.0f} s")
    earlier = rows_of_page(given.table.read_text()) if given.table.exists() else {}
    trials: list[Trial] = []
    for number in wanted:
        names = levels_for(number)[: given.levels]
        trials += trials_of(number, names)
        given.table.write_text(page_of(trials, numbers(), earlier))
        console.print(f"{time.strftime('%H:%M')} {number.title}" + ("" if names else ": no level reads it"))


if __name__ == "__main__":
    main()
