"""Journey 10: shards on two machines, one of which dies; assembled, released, and opened by other programs."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from houseexpo import open_dataset
from tests.builders.batch import contents
from tests.builders.needs import need
from tests.journeys.pages import blocks, commands, python_block

SHARDS, RELEASE = "docs/guide-cluster.md", "docs/guide-release.md"
PRINT_ROWS = "\nimport json; print(json.dumps([[row['id'], row['rooms'], row['doors']] for row in plans]))"


def start(command: str, machine: Path) -> subprocess.Popen[str]:
    """Start a command of a page on a machine: a process group with a folder and a cache of its own."""
    words = [sys.executable, "-m", *shlex.split(command)]
    machine.mkdir(exist_ok=True)
    return subprocess.Popen(
        words,
        cwd=machine,
        env={**os.environ, "HOUSEEXPO_CACHE": str(machine / "cache")},
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def run(command: str, machine: Path, code: int = 0) -> str:
    """Run a command to its end, which must have this exit code, and return what it said."""
    process = start(command, machine)
    said, _ = process.communicate(timeout=600)
    assert process.returncode == code, said
    return said


@pytest.mark.slow
def test_shards_of_which_one_dies_become_a_release(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    need(modules=["datasets", "duckdb"], how="make readers")
    houses, shared = tmp_path / "houses.toml", tmp_path / "shared"
    houses.write_text('[build]\nsources = ["procedural:24?style=published"]\nseed = 3\n')
    here, there = tmp_path / "here", tmp_path / "there"

    def placed(command: str) -> str:
        return command.replace("houses.toml", str(houses)).replace("/shared/plans", str(shared / "plans"))

    first, second, assemble = map(placed, commands(SHARDS, "houseexpo assemble /shared/plans"))
    dying, whole = start(second, there), start(first, here)
    while dying.poll() is None and not list((shared / "plans").rglob("*.json")):
        time.sleep(0.05)
    os.killpg(dying.pid, signal.SIGKILL)
    dying.wait()
    assert whole.wait(timeout=600) == 0

    said = run(assemble, here, code=3)
    assert re.search(r"1/2", said), "it names the shard that is not done"
    assert not (shared / "plans" / "index.parquet").exists()
    run(second, there)
    run(assemble, here)
    run(f"houseexpo build --config {houses} --out {tmp_path / 'alone'}", here)
    assert contents(shared / "plans") == contents(tmp_path / "alone")

    made = commands(RELEASE, "a folder that can be uploaded")[0]
    run(made.replace("plans/demo", str(shared / "plans")), tmp_path)
    monkeypatch.chdir(tmp_path)
    apart = {"HF_HUB_OFFLINE": "1", "HF_DATASETS_OFFLINE": "1", "HF_HOME": str(tmp_path / "home")}
    script = python_block(RELEASE, "load_dataset") + PRINT_ROWS  # a process of its own: datasets keeps its first cache
    done = subprocess.run(
        [sys.executable, "-c", script], env={**os.environ, **apart}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    plans = open_dataset(shared / "plans")
    rows = json.loads(done.stdout.splitlines()[-1])
    assert rows
    for name, rooms, doors in rows:
        assert (rooms, doors) == (len(plans[name].rooms), len(plans[name].doors))

    import duckdb

    of_doors, of_homes = blocks(RELEASE, "sql")
    kinds = [door.kind for plan in plans for door in plan.doors]
    with duckdb.connect() as database:
        counts = {kind: number for kind, number, _ in database.execute(of_doors).fetchall()}
        homes = database.execute(of_homes).fetchall()
    assert counts == {kind: kinds.count(kind) for kind in kinds}
    assert sum(number for *_, number, _furnished in homes) == len(plans)
