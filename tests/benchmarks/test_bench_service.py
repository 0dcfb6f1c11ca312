"""The data service on the published data set: a filter, 50 clients at once, eight robots, memory.

The clients ask over loopback for what a gallery asks: pages of plans, counts of new filters, thumbnails, plans. They
run in a process of their own, so that they do not take the server's time but the machine's; what they take is printed
beside the server's. Plans are asked for at random: most thumbnails are made, not remembered. A client asks again when
it is answered, so it waits for those of the 49 others: the median is near 50 divided by the requests a second.

Eight robots drive at 30 frames a second on two cores: frames that eight browsers get, the server's time and memory.
The browsers are sockets that say at once that they have drawn a frame.
"""

from __future__ import annotations

import asyncio
import gzip
import json
import multiprocessing
import os
import random
import re
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import psutil
import pytest

pytest.importorskip("websockets")
from rich.console import Console
from rich.table import Table
from websockets.asyncio.client import connect

from houseexpo import open_dataset, save_plan
from houseexpo.floorplan import decode
from houseexpo.service.collection import OpenedDataset
from houseexpo.service.drive.messages import ENDED, HEAD, KIND
from houseexpo.service.search import parse_query
from tests.builders.shared import DATA, needs_shared

PLANS = DATA / "houseexpo" / "plans_33717.jsonl.gz"
CLIENTS, SECONDS = 50, 15.0
FILTERS = (
    *("rooms=3..6&area=50..200", "labels=Kitchen,Garage&sort=-area"),
    *("without=Hall&area=..90", "text=garage&rooms=5"),
)
START = "from houseexpo.commands.serve import serve; import typer, sys; typer.run(serve)"

pytestmark = needs_shared


@pytest.fixture(scope="module")
def server() -> Iterator[tuple[str, psutil.Process]]:
    """The service in a process of its own, warm."""
    command = [sys.executable, "-c", START, str(PLANS), "--port", "0", "--read-only"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            address = next(found[0] for line in process.stdout if (found := re.search(r"http://\S+", line)))
            yield address.rstrip("/"), psutil.Process(process.pid)
        finally:
            process.terminate()


def test_a_filter_on_all_published_plans() -> None:
    """Median and worst of combined filters, each asked once: nothing is remembered."""
    views = OpenedDataset(open_dataset(PLANS)).views
    views.find(parse_query({"sort": "-area"}))
    times = []
    for low in range(40):
        query = {"rooms": f"{low % 7}..", "area": f"{low}..{low + 150}"}
        query |= {"labels": "Kitchen", "text": "bedroom", "sort": "-area"}
        start = time.perf_counter()
        views.find(parse_query(query))
        times.append(1000 * (time.perf_counter() - start))
    table = Table("filter on 33,717 plans", "median, ms", "worst, ms", "asked")
    table.add_row("range, label, text, sort", f"{statistics.median(times):.1f}", f"{max(times):.1f}", "100")
    Console().print(table)


def test_fifty_clients(server: tuple[str, psutil.Process]) -> None:
    """Requests a second and their times, and the server's memory at the end."""
    address, process = server
    ids = open_dataset(PLANS).ids
    with multiprocessing.get_context("spawn").Pool(1) as clients:
        before = _cpu_s(process)
        times, failed, clients_s = clients.apply(_crowd, (address, Path(PLANS).name.split(".")[0], ids[::7]))
    times.sort()
    cpu_ms = " / ".join(f"{1000 * spent / len(times):.1f}" for spent in (_cpu_s(process) - before, clients_s))
    memory = process.memory_info().rss / 2**20
    columns = ("requests/s", "p50, ms", "p95", "p99", "failed", "memory, MB", "CPU ms a request: server / clients")
    table = Table("50 clients", *columns)
    row = [f"{times[int(len(times) * share)] * 1000:.0f}" for share in (0.5, 0.95, 0.99)]
    table.add_row("found", f"{len(times) / SECONDS:.0f}", *row, str(failed), f"{memory:.0f}", cpu_ms)
    table.add_row("asked", "300", "", "150", "", "0", "500", "")
    Console().print(table)
    assert failed == 0


def _cpu_s(process: psutil.Process) -> float:
    return float(sum(process.cpu_times()[:2]))


def _crowd(address: str, name: str, ids: list[str]) -> tuple[list[float], int, float]:
    """Ask for a while; return the times of the requests, how many failed, and the clients' own processor time."""
    before = time.process_time()
    return *asyncio.run(_asking(address, name, ids)), time.process_time() - before


async def _asking(address: str, name: str, ids: list[str]) -> tuple[list[float], int]:
    times: list[float] = []
    failed = 0
    parts = urlsplit(address)
    until = time.perf_counter() + SECONDS

    async def client(number: int) -> None:
        nonlocal failed
        rng = random.Random(number)  # noqa: S311
        reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
        while time.perf_counter() < until:
            start = time.perf_counter()
            failed += await _status(reader, writer, parts.netloc, _path(rng, name, ids)) != 200
            times.append(time.perf_counter() - start)
        writer.close()

    await asyncio.gather(*(client(number) for number in range(CLIENTS)))
    return times, failed


async def _status(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, host: str, path: str) -> int:
    """Ask over a connection that stays open, read the answer whole: little work, so that the server has the cores."""
    writer.write(f"GET {path} HTTP/1.1\r\nhost: {host}\r\n\r\n".encode())
    head = (await reader.readuntil(b"\r\n\r\n")).lower()
    length = int(head.split(b"content-length: ")[1].split(b"\r\n")[0])
    await reader.readexactly(length)
    return int(head.split(b" ")[1])


def _path(rng: random.Random, name: str, ids: list[str]) -> str:
    """What a person's browser asks for: mostly pictures, then pages of plans, then counts, then plans."""
    kind = rng.random()
    if kind < 0.6:
        return f"/api/{name}/plans/{rng.choice(ids)}/thumbnail.svg"
    if kind < 0.8:
        return f"/api/{name}/plans?{rng.choice(FILTERS)}&offset={100 * rng.randrange(10)}&limit=100"
    if kind < 0.9:
        return f"/api/{name}/facets?{rng.choice(FILTERS)}&vertices=..{rng.randrange(1000)}"
    return f"/api/{name}/plans/{rng.choice(ids)}"


ROBOTS = 8
DRIVE_SECONDS = 10.0
WARM_S = 4.0


@contextmanager
def served(dataset: Path) -> Iterator[tuple[int, psutil.Process]]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-c", START, str(dataset), "--port", str(port)]
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
        while "preparing" in (said := json.loads(await browser.recv())):
            pass
        assert "hello" in said
        await browser.send(json.dumps({"do": "pace", "steps_per_s": 30}))
        if driver == "you":  # the same keys would take over from an explorer
            await browser.send(json.dumps({"do": "move", "linear": 0.7, "angular": 0.4}))
        begin, flags = time.monotonic(), 0
        came: list[tuple[float, int]] = []
        while time.monotonic() < begin + WARM_S + DRIVE_SECONDS and not flags & ENDED:
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
