"""Servers as people run them: two at once on one data set, and one that is killed."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
import tomllib
import urllib.request
from pathlib import Path

import pytest

pytest.importorskip("starlette")

from tests.builders.services import ROOT, judged_later

pytestmark = pytest.mark.slow
PLANS = [f"plan_{i:03}" for i in range(60)]
RUN = "import typer; from houseexpo.commands.serve import serve; typer.run(serve)"


class Running:
    """A server in a process of its own."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = int(free.getsockname()[1])
        command = [sys.executable, "-c", RUN, str(folder), "--review", "--port", str(self.port)]
        self.process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL)
        self.answered: list[str] = []

    def ready(self) -> Running:
        for _ in range(600):
            with socket.socket() as probe:
                if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                    return self
            time.sleep(0.1)
        raise TimeoutError("the server did not start")

    def decide(self, plan: str, reviewer: str, seen: int = 0) -> None:
        body = json.dumps({"plan": plan, "action": "keep", "reviewer": reviewer, "seen": seen}).encode()
        address = f"http://127.0.0.1:{self.port}/houses/review/decide"
        with urllib.request.urlopen(urllib.request.Request(address, body), timeout=30) as answer:
            assert json.load(answer)["noted"]
        self.answered.append(plan)

    def decide_all(self, plans: list[str], reviewer: str) -> None:
        try:
            for plan in plans:
                self.decide(plan, reviewer)
        except OSError:  # the server is gone
            return


def test_two_servers_one_of_them_killed_lose_nothing_that_was_answered(tmp_path: Path) -> None:
    folder = judged_later(tmp_path / "houses", dict.fromkeys(PLANS, 0.5))
    servers = [Running(folder), Running(folder)]
    try:
        work = [
            threading.Thread(target=server.ready().decide_all, args=(PLANS[i::2], name))
            for i, (server, name) in enumerate(zip(servers, ("ann", "ben"), strict=True))
        ]
        for thread in work:
            thread.start()
        while len(servers[0].answered) < 5:
            time.sleep(0.005)
        os.kill(servers[0].process.pid, signal.SIGKILL)
        for thread in work:
            thread.join(120)
        servers[1].decide(PLANS[0], "ann", seen=len(PLANS))  # the next decision puts in order what was left
    finally:
        for server in servers:
            server.process.kill()
            server.process.wait()
    answered = {plan for server in servers for plan in server.answered}
    assert set(PLANS[1::2]) <= answered
    kept = tomllib.loads((folder / "overrides.toml").read_text())
    lines = [json.loads(line) for line in (folder / "overrides.log.jsonl").read_text().splitlines()]
    assert answered <= {line["plan"] for line in lines} == set(kept)
    assert [line["number"] for line in lines] == list(range(1, len(lines) + 1))
