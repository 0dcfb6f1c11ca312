"""No figure and no promise of the pages stands alone, and the quick ones are true."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from _pytest.mark.expression import Expression

from tests.claims import values
from tests.claims.figures import read_blocks
from tests.claims.places import ROOT, is_test
from tests.claims.registry import Claim, Compare, blocks, differences, read_registry

REGISTRY = read_registry()
BLOCKS = list(blocks())


def test_each_figure_rests_on_something() -> None:
    alone = [
        f"{block.page}:{block.line}: {', '.join(figures)}"
        for block in BLOCKS
        if (figures := [figure for figure in block.figures if figure not in REGISTRY.everywhere])
        and not any(claim.covers(block) for claim in REGISTRY.claims)
    ]
    assert not alone, "no entry of tests/claims/claims.toml speaks of:\n" + "\n".join(alone)


def test_each_promise_has_a_test() -> None:
    alone = [
        f"{block.page}:{block.line}: {', '.join(block.promises)}"
        for block in BLOCKS
        if block.promises
        and block.page != "docs/paper.md"  # each of its entries has tests
        and not any(
            promise.page == block.page and promise.says in block.text.replace("\n", " ")
            for promise in REGISTRY.promises
        )
    ]
    assert not alone, "add a test to tests/claims/claims.toml, or take the word away:\n" + "\n".join(alone)


def test_no_entry_is_idle() -> None:
    claims = [claim.name for claim in REGISTRY.claims if not claim.numbers and not claim.value]
    spoken = {
        next((claim.name for claim in REGISTRY.claims if claim.covers(block)), "") for block in BLOCKS if block.figures
    }
    assert [name for name in claims if name not in spoken] == []
    texts = {page: " ".join(block.text.replace("\n", " ") for block in BLOCKS if block.page == page) for page in
             {block.page for block in BLOCKS}}  # fmt: skip
    assert [promise for promise in REGISTRY.promises if promise.says not in texts[promise.page]] == []


def test_tests_code_and_commands_that_entries_name_exist() -> None:
    tests = [claim.test for claim in REGISTRY.claims if claim.test] + [each.test for each in REGISTRY.promises]
    assert [test for test in tests if not (is_test(test) if "::" in test else (ROOT / test).is_file())] == []
    assert [place for claim in REGISTRY.claims for place in claim.code if not (ROOT / place).exists()] == []
    words = [word for claim in REGISTRY.claims for word in claim.command.split()]
    assert [word for word in words if word.startswith("tests/") and not (ROOT / word).is_file()] == []


@pytest.mark.parametrize("name", sorted({claim.value for claim in REGISTRY.claims if claim.value}))
def test_a_quick_claim_is_true(name: str) -> None:
    assert getattr(values, name)() == []


@pytest.mark.parametrize(
    ("text", "figures"),
    [
        ("Takes 12 ms and 1.5 GB of memory.", ["12", "1.5"]),
        ("Gaps of up to 1.5 m, at 25 px/m, in 200 steps.", []),
        ("Of 41 models 38 are right, that is 93%.", ["41", "93"]),
        ("Draws at most 200 plans, in at most 3 s.", ["3"]),
        ("Since Python 3.11, on 2026-11-28, by commit 82c7813, of 2019.", []),
        ("`--limit 20` [here](a-20.md) makes two plans.", []),
        ("| what | found |\n|---|---|\n| a plan | 23 |", ["23"]),
        ("| key | meaning |\n|---|---|\n| `a` | 23 |", []),
    ],
)
def test_figures_are_told_from_dimensions_and_names(text: str, figures: list[str], tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(f"# A page\n{text}\n")
    (block,) = read_blocks(page, "page.md")
    assert block.figures == figures


def test_a_page_that_says_otherwise_than_its_command_is_found_out() -> None:
    claim = Claim("README.md", command="x", compare=(Compare(r"free space ([\d.]+)", r"IoU ([\d.]+)", 0.01),))
    said = differences(claim, "IoU 0.5")
    assert len(said) == 1
    assert "the command 0.5" in said[0]
    assert differences(claim, "IoU 0.997") == []
    assert differences(claim, "nothing") == ["'IoU ([\\\\d.]+)' is not there"]


@pytest.mark.slow
def test_what_a_command_chooses_with_k_is_there() -> None:
    listed = subprocess.run(
        [sys.executable, "-m", "pytest", "--collect-only", "-q", "--benchmarks", "tests/benchmarks"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    ).stdout.splitlines()  # fmt: skip
    idle = []
    for claim in REGISTRY.claims:
        words = shlex.split(claim.command)
        if "-k" not in words:
            continue
        files = [word for word in words if word.startswith("tests/")]
        wanted = Expression.compile(words[words.index("-k") + 1])
        names = [line.lower() for line in listed if line.startswith(tuple(files))]
        if not any(wanted.evaluate(lambda word, name=name, **_: word.lower() in name) for name in names):
            idle.append(claim.how)
    assert idle == []
