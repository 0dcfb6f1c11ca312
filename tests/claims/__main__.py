"""``python -m tests.claims``: say of each claim of the pages whether it is true, false, older than its code, or cannot
be tried here.

Quick ones are tried; with ``--run minutes`` those of minutes too (``make claims``, an hour at most), with ``--run
hours`` all. ``--only TEXT`` takes the claims whose page or section has this text.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from typing import Final, get_args

from rich.console import Console

from tests.claims import values
from tests.claims.places import ROOT
from tests.claims.registry import Claim, Cost, changes_since, differences, missing_needs, read_registry

COSTS: Final = get_args(Cost)
LIMIT_S: Final = {"seconds": 60, "minutes": 900, "hours": 6 * 3600}
HOUR_S: Final = 3600
"""``--run minutes`` begins nothing more after this long."""


def main(arguments: list[str] | None = None) -> int:
    """Report; 1 if a claim is false."""
    parser = argparse.ArgumentParser(prog="python -m tests.claims", description=__doc__)
    parser.add_argument("--run", choices=COSTS, default="seconds", help="the dearest commands that are run")
    parser.add_argument("--only", default="", metavar="TEXT")
    asked = parser.parse_args(arguments)
    console = Console(highlight=False, markup=False)
    begun, found = time.monotonic(), dict[str, int]()
    for claim in read_registry().claims:
        if asked.only not in claim.name:
            continue
        late = asked.run == "minutes" and time.monotonic() - begun > HOUR_S
        verdict, why = judge(claim, "seconds" if late else asked.run)
        found[verdict] = found.get(verdict, 0) + 1
        console.print(
            f"{verdict:7} {claim.name}", *(f"        {line}" for line in [claim.how, *why]), sep="\n", soft_wrap=True
        )
    console.print(", ".join(f"{number} {verdict}" for verdict, number in sorted(found.items())))
    return int("false" in found)


def judge(claim: Claim, dearest: Cost) -> tuple[str, list[str]]:
    """Return "true", "false", "older", "needs" or "not run", and why."""
    missing = missing_needs(claim)
    if missing:
        return "needs", missing
    if claim.value:
        wrong = getattr(values, claim.value)()
        return ("false", wrong) if wrong else ("true", [])
    if not claim.judged and COSTS.index(claim.cost) <= COSTS.index(dearest):
        return run(claim)
    changes = changes_since(claim.measured, claim.code) if claim.measured else None
    if changes:
        return "older", [f"{changes} commits since {claim.measured} changed {', '.join(claim.code)}"]
    return "not run", [f"it takes {claim.cost}"]


def run(claim: Claim) -> tuple[str, list[str]]:
    """Run what a claim rests on."""
    words = (claim.command or f"python -m pytest -q {claim.test}").replace("python ", f"{sys.executable} ", 1)
    try:
        done = subprocess.run(
            ["bash", "-c", words], cwd=ROOT, capture_output=True, text=True, timeout=LIMIT_S[claim.cost], check=False
        )
    except subprocess.TimeoutExpired:
        return "false", [f"not done after {LIMIT_S[claim.cost]} s"]
    if done.returncode:
        return "false", [*(done.stdout + done.stderr).splitlines()[-5:]]
    if "skipped" in done.stdout and " passed" not in done.stdout:
        return "needs", [line for line in done.stdout.splitlines() if "skipped" in line][-1:]
    wrong = differences(claim, done.stdout)
    return ("false", wrong) if wrong else ("true", [])


if __name__ == "__main__":
    sys.exit(main())
