"""Eight robots at 30 frames a second on two cores: frames that eight browsers get, the server's time and memory.

The server runs in a process of its own; browsers are sockets that say at once that they have drawn a frame.
"""

from __future__ import annotations

import asyncio
import gzip
import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

pytest.importorskip("websockets")
from rich.console import Console
from websockets.asyncio.client import connect

from houseexpo import save_plan
from houseexpo.floorplan import decode
from houseexpo.service.drive.frames import ENDED, HEAD, KIND
from tests.builders.shared import DATA, needs_shared

pytestmark = needs_shared

ROBOTS = 8
SECONDS = 10.0
WARM_S = 4.0


@contextmanager
def served(dataset: Path) -> Iterator[tuple[int, psutil.Process]]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    run = "import sys, typer; from houseexpo.commands.serve import serve; typer.run(serve)"
    command = [sys.executable, "-c", run, str(dataset), "--port", str(port)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, env={**os.environ}) as process:
        try:
            for _ in range(600):
                with socket.socket() as probe:
                    if probe.connect_ex(("127.0.0.1", port)) == 0:
                        break
                time.sleep(0.1)
            yield port, psutil.Process(process.pid)
        finally:
            process.terminate()


async def robot(address: str, plan: str, driver: str, seed: int) -> tuple[float, float]:
    """Drive in a circle, or watch an explorer to its end; return frames a second, and kilobytes a frame."""
    async with connect(address, max_size=None) as browser:
        await browser.send(json.dumps({"do": "start", "plan": plan, "driver": driver, "seed": seed, "fov_deg": 180}))
        assert "hello" in json.loads(await browser.recv())
        await browser.send(json.dumps({"do": "pace", "steps_per_s": 30}))
        await browser.send(json.dumps({"do": "move", "linear": 0.7, "angular": 0.4}))
        begin, flags = time.monotonic(), 0
        came: list[tuple[float, int]] = []
        while time.monotonic() < begin + WARM_S + SECONDS and not flags & ENDED:
            data = await browser.recv()
            assert isinstance(data, bytes)
            kind, flags, _, number = HEAD.unpack_from(data)[:4]
            assert kind == KIND
            await browser.send(json.dumps({"do": "seen", "number": number}))
            came.append((time.monotonic(), len(data)))
        late = [each for each in came if each[0] > begin + WARM_S] or came
        return (len(late) - 1) / (late[-1][0] - late[0][0]), sum(size for _, size in late) / len(late) / 1000


@pytest.mark.parametrize("driver", ["you", "frontier"])
def test_eight_robots_at_thirty_frames(homes: Path, driver: str) -> None:
    names = sorted(file.stem for file in homes.glob("*.json"))
    with served(homes) as (port, process):
        address = f"ws://127.0.0.1:{port}/homes/drive/robot"
        asyncio.run(robots(address, names, "you"))  # compiles
        before, start = process.cpu_times(), time.monotonic()
        found = asyncio.run(robots(address, names, driver))
        took, after = time.monotonic() - start, process.cpu_times()
        cores = (after.user + after.system - before.user - before.system) / took
        rates, sizes = zip(*found, strict=True)
        memory = process.memory_info().rss / 1e6
    Console().print(
        f"{driver}: {ROBOTS} robots, {min(rates):.1f} to {max(rates):.1f} frames/s (asked: 30), "
        f"{max(sizes):.2f} kB a frame at most, {cores:.2f} cores, {memory:.0f} MB (asked: 500)"
    )


async def robots(address: str, names: list[str], driver: str) -> list[tuple[float, float]]:
    return await asyncio.gather(*(robot(address, name, driver, seed) for seed, name in enumerate(names)))


@pytest.fixture(scope="module")
def homes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of eight published plans, 100 to 240 m2."""
    folder: Path = tmp_path_factory.mktemp("bench") / "homes"
    folder.mkdir()
    with gzip.open(DATA / "houseexpo" / "plans_33717.jsonl.gz") as stream:
        plans = [decode(line) for line, _ in zip(stream, range(300), strict=False)]
    for area in range(100, 260, 20):
        save_plan(plan := min(plans, key=lambda each: abs(each.area - area)), folder / f"{plan.id}.json")
        plans.remove(plan)
    return folder
