"""Data sets to be judged: small plans with a quality and a frame, and people who decide in processes of their own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from houseexpo import FloorPlan, save_plan
from houseexpo.dataset.index import index_table
from houseexpo.plan import Frame
from houseexpo.plan.parts import Quality

ROOT = Path(__file__).resolve().parents[2]
FRAME = Frame(((1.0, 0.0, 10.0), (0.0, 1.0, -2.0)), "z", 0.0, 0)
"""The source's axes lie 10 m to the left of the plan's, and 2 m above."""

CLERK = """
import sys
from pathlib import Path
from houseexpo.service.review.decisions import Decisions
file, reviewer, count = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
decisions = Decisions(file)
for i in range(count):
    line = decisions.decide(f"{reviewer}_{i}", "no_room", reviewer, [float(i), 1.0])
    print(line.plan, flush=True)
"""


def judged_later(folder: Path, qualities: dict[str, float | None]) -> Path:
    """Write plans of these qualities, None: without one and without a frame; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for i, (name, score) in enumerate(qualities.items()):
        ring = [(0.1, 0.1), (0.1, 4.1), (5.1 + i, 4.1), (5.1 + i, 0.1)]
        told = {} if score is None else {"quality": Quality(score, {"cut_share": 0.5}), "frame": FRAME}
        save_plan(FloorPlan(name, ring, 1, {}, **told), folder / f"{name}.json")
    return folder


def no_plans(folder: Path) -> Path:
    """Write what a build leaves that refused all of its houses; return the folder."""
    (folder / "json").mkdir(parents=True)
    (folder / "index.parquet").write_bytes(index_table([]))
    (folder / "manifest.json").write_text('{"plans": 0}')
    return folder


def clerk(file: Path, reviewer: str, count: int) -> subprocess.Popen[str]:
    """Start somebody who decides on so many plans, and names each of them when it is answered."""
    command = [sys.executable, "-c", CLERK, str(file), reviewer, str(count)]
    return subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
