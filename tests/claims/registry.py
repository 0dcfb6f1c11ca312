"""Read ``claims.toml``: what each claim of a page rests on.

A claim names a page, and in it a section, or the blocks of a section that begin with some words. It rests on one of
these:

``value``
    A function of ``tests/claims/values.py`` that says in some seconds whether the page is right. CI runs them all.
``test``
    A test of the suite, which fails where the claim is false.
``command``
    A command of minutes or hours. ``compare`` pairs a pattern of the page with one of what the command prints; each
    has one group, a number, and the two numbers may differ by the share ``within``. Without ``compare`` the command's
    exit code decides: benchmarks fail where their goals are missed.
``judged``
    Eyes. ``command`` says how to look again.

``measured`` is the commit at which the figures were measured, ``code`` what they depend on: where that has changed
since, the claim is older than its code. ``needs`` names what does not come with the project (``NEEDS``).
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, get_args

from tests.builders.needs import is_installed
from tests.builders.shared import DATA
from tests.claims.figures import Block, read_blocks
from tests.claims.places import ROOT

FILE: Final = Path(__file__).with_name("claims.toml")
MADE: Final = {"docs/leaderboard.md", "docs/commands.md", "docs/changelog.md"}
"""Pages that a program writes; tests compare them with what it writes."""

Cost = Literal["seconds", "minutes", "hours"]
NEEDS: Final[dict[str, tuple[str, Callable[[], bool]]]] = {
    "plans": (
        "the published plans as ../shared/data/houseexpo/plans_33717.jsonl.gz; houseexpo fetch gets them",
        (DATA / "houseexpo" / "plans_33717.jsonl.gz").is_file,
    ),
    "real houses": (
        "the public houses in ../shared/data; tests/builders/examples.py names them",
        (DATA / "ifc").is_dir,
    ),
    "robots' maps": (
        "Bormann's maps (github.com/ipa-rmb/autopnp) and ROSE2's (github.com/aislabunimi/ROSE2) in ../shared/data/maps",
        (DATA / "maps" / "bormann").is_dir,
    ),
    "corpus": (
        "the files of tests/corpus/manifest.toml: python -m tests.corpus FOLDER --fetch, with the network",
        lambda: "HOUSEEXPO_CORPUS" in os.environ,
    ),
    "plan collections": ("the data sets of docs/guide-statistics.md, each from its authors", lambda: False),
    "DARE": ("a clone of github.com/marmotlab/DARE and what its code needs", lambda: False),
    "icp-slam": ("apt-get install mrpt-apps", lambda: shutil.which("icp-slam") is not None),
    "learn": ("make learn", lambda: is_installed("sb3_contrib")),
    "ros": ("make ros", lambda: is_installed("cyclonedds")),
    "a clone": ("the network, git and an idle machine: .ci/front-door", lambda: False),
    "an idle machine": ("two cores on which nothing else runs", lambda: True),
}


@dataclass(frozen=True)
class Compare:
    """A pattern of the page and one of the output, each with one group, and how far the two numbers may be apart."""

    page: str
    output: str
    within: float = 0.0


@dataclass(frozen=True)
class Claim:
    """An entry of the registry; the module's docstring explains the fields."""

    page: str
    section: str = ""
    begins: str = ""
    numbers: tuple[str, ...] = ()
    value: str = ""
    test: str = ""
    command: str = ""
    judged: bool = False
    compare: tuple[Compare, ...] = ()
    cost: Cost = "minutes"
    needs: tuple[str, ...] = ()
    code: tuple[str, ...] = ()
    measured: str = ""

    def __post_init__(self) -> None:
        wrong = [need for need in self.needs if need not in NEEDS]
        if wrong or self.cost not in get_args(Cost) or not (self.value or self.test or self.command):
            raise ValueError(
                f"{self.name}: expected value, test or command, a known cost and known needs; found {self}"
            )

    @property
    def name(self) -> str:
        """What it is called in reports and in the ids of tests."""
        return " / ".join(filter(None, (self.page, self.section, self.begins.split("\n")[0], *self.numbers)))

    @property
    def how(self) -> str:
        """What one can type to try it."""
        return self.command or f"python -m pytest {self.test or 'tests/claims -k ' + self.value}"

    def covers(self, block: Block) -> bool:
        """Whether it speaks of all figures of a block."""
        in_section = self.section in {"", block.heading}
        return not self.numbers and self.page == block.page and in_section and block.text.startswith(self.begins)


@dataclass(frozen=True)
class Promise:
    """A sentence with a word that promises, and the test that shows it. ``says`` are some of its words."""

    page: str
    says: str
    test: str


@dataclass(frozen=True)
class Registry:
    """All claims and promises."""

    claims: tuple[Claim, ...]
    promises: tuple[Promise, ...]
    everywhere: frozenset[str] = field(default_factory=frozenset)


def read_registry(file: Path = FILE) -> Registry:
    """Read and check the registry."""
    said = tomllib.loads(file.read_text())
    claims = tuple(_claim(each) for each in said["claim"])
    numbers = frozenset(number for claim in claims for number in claim.numbers)
    return Registry(claims, tuple(Promise(**each) for each in said["promise"]), numbers)


def _claim(said: dict[str, Any]) -> Claim:
    said["compare"] = tuple(Compare(*each) for each in said.get("compare", ()))
    return Claim(**{key: tuple(value) if isinstance(value, list) else value for key, value in said.items()})


def pages() -> list[Path]:
    """README.md and the pages of docs, but for those that a program writes."""
    found = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [page for page in found if "_build" not in page.parts and _name(page) not in MADE]


def blocks() -> Iterator[Block]:
    """Yield all blocks of all pages."""
    for page in pages():
        yield from read_blocks(page, _name(page))


def _name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def missing_needs(claim: Claim) -> list[str]:
    """What a claim needs and this machine lacks, each with where to get it."""
    return [f"{need}: {NEEDS[need][0]}" for need in claim.needs if not NEEDS[need][1]()]


def changes_since(commit: str, code: Sequence[str]) -> int | None:
    """Number of commits since ``commit`` that changed the code; None where git does not know the commit."""
    done = subprocess.run(
        ["git", "rev-list", "--count", f"{commit}..HEAD", "--", *code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return int(done.stdout) if done.returncode == 0 else None


def differences(claim: Claim, printed: str) -> list[str]:
    """Compare what a command printed with the page; name what differs."""
    page = (ROOT / claim.page).read_text()
    wrong = []
    for each in claim.compare:
        said, found = re.search(each.page, page, re.DOTALL), re.search(each.output, printed, re.DOTALL)
        if said is None or found is None:
            wrong.append(f"{each.page if said is None else each.output!r} is not there")
        elif abs(_number(found[1]) - _number(said[1])) > each.within * abs(_number(said[1])):
            wrong.append(f"the page says {said[1]}, the command {found[1]}")
    return wrong


def _number(text: str) -> float:
    return float(text.replace(",", ""))
