"""Data sets on show and under review, the servers that show them, and a web server that misbehaves as it is told."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import msgspec

from houseexpo import save_plan
from houseexpo.dataset.index import index_row, index_table
from houseexpo.floorplan import FloorPlan
from houseexpo.plan import Door, Frame, PlanObject, Quality, Room
from houseexpo.plan.json_codec import encode
from houseexpo.service.collection import open_collections
from houseexpo.service.service import Service, ServiceSettings

BASE = "http://localhost:8000"


def box(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float]]:
    """A rectangle, clockwise."""
    return [(x1, y1), (x1, y2), (x2, y2), (x2, y1)]


def two_rooms(name: str, width: float = 4.0, quality: float = 0.9, label: str = "Kitchen") -> FloorPlan:
    """Rooms of ``width`` x 3 m and 3 x 3 m, a wall of 0.1 m between them, a door of 0.8 m in it."""
    a, b = round(0.1 + width, 2), round(0.2 + width, 2)
    c = round(b + 3.0, 2)
    outline = [(0.1, 0.1), (0.1, 3.1), (a, 3.1), (a, 1.9), (b, 1.9), (b, 3.1), (c, 3.1), (c, 0.1), (b, 0.1)]
    outline += [(b, 1.1), (a, 1.1), (a, 0.1)]
    rooms = (Room(0, label, box(0.1, 0.1, a, 3.1)), Room(1, "Bedroom", box(b, 0.1, c, 3.1)))
    middle = round((a + b) / 2, 2)
    door = Door(0, "door", ((middle, 1.1), (middle, 1.9)), 0.8, box(a, 1.1, b, 1.9), (0, 1))
    boxes = {label: (rooms[0].polygon.bounds,), "Bedroom": (rooms[1].polygon.bounds,)}
    told = {"source": "made", "file": f"{name}.glb"}
    return FloorPlan(
        name,
        outline,
        2,
        boxes,
        rooms=rooms,
        doors=(door,),
        provenance=told,
        quality=Quality(quality, {"cut_share": 0.0}),
    )


def furnished(name: str) -> FloorPlan:
    """Two rooms; a table in the middle of the bedroom leaves 1 m on each side of it."""
    plan, table = two_rooms(name), box(5.2, 1.1, 6.2, 2.1)
    kitchen, bedroom = plan.rooms
    return replace(
        plan,
        holes=(table,),
        rooms=(kitchen, replace(bedroom, holes=(table,))),
        objects=(PlanObject(0, "table", 1, table, 0.7),),
    )


def built(folder: Path, plans: list[FloorPlan], train: tuple[str, ...] = ()) -> Path:
    """Write plans as ``houseexpo build`` leaves them, with inputs refused and a duplicate dropped."""
    (folder / "json").mkdir(parents=True, exist_ok=True)
    for old in (folder / "json").iterdir():
        old.unlink()
    for plan in plans:
        (folder / "json" / f"{plan.id}.json").write_bytes(encode(plan))
    (folder / "index.parquet").write_bytes(index_table([index_row(plan) for plan in plans]))
    (folder / "splits").mkdir(exist_ok=True)
    (folder / "splits" / "train.txt").write_text("".join(f"{name}\n" for name in train))
    lines(folder / "rejected.jsonl", [
        {"id": "shed", "stage": "rooms", "reason": "too_small", "detail": "2.1 m2", "advice": "none"},
        {"id": "<b>hut</b>", "stage": "rooms", "reason": "too_small", "detail": "1.0 m2", "advice": "none"},
        {"id": "car", "stage": "reading", "reason": "no_floor", "detail": "no floor", "advice": "check the file"},
    ])  # fmt: skip
    lines(folder / "duplicates.jsonl", [
        {"id": "twin", "kept_id": plans[0].id, "difference": 0.0123, "symmetry": "mirror_x"}
    ])  # fmt: skip
    (folder / "manifest.json").write_text(f'{{"plans": {len(plans)}}}')
    return folder


def lines(file: Path, values: list[dict[str, Any]]) -> None:
    """Write values as JSON lines."""
    file.write_bytes(b"".join(msgspec.json.encode(value) + b"\n" for value in values))


def published(file: Path, count: int) -> Path:
    """Write plans of the published kind: an outline and a label box each, 3 to 3 + count / 2 m wide."""
    from tests.builders.plan_files import houses

    file.write_bytes(b"".join(data + b"\n" for data in houses(count).values()))
    return file


def some_plans() -> list[FloorPlan]:
    """Four plans that differ in width, quality and the first room's label."""
    return [
        two_rooms("a1", 4.0, 0.95),
        two_rooms("b2", 5.0, 0.55, "Garage"),
        two_rooms("c3", 7.0, 0.75),
        two_rooms("d 4&é", 4.1, 0.85, "Bathroom"),
    ]


def service_of(*paths: Path, **settings: Any) -> Service:
    """Return a service of data sets."""
    return Service(open_collections(paths), ServiceSettings(**settings))


@contextmanager
def running(service: Service) -> Iterator[str]:
    """Run a service on a free port of this machine; yields its address, without a slash at the end."""
    import uvicorn

    from houseexpo.service.app import make_app

    listening = socket.socket()
    listening.bind(("127.0.0.1", 0))
    server = uvicorn.Server(uvicorn.Config(make_app(service), log_level="error", ws="websockets-sansio"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
    thread.start()
    while not server.started and thread.is_alive():
        time.sleep(0.01)
    try:
        yield f"http://127.0.0.1:{listening.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join(10)
        listening.close()


# Data sets to be judged: small plans with a quality and a frame, and people who decide in processes of their own.


ROOT = Path(__file__).resolve().parents[2]
FRAME = Frame(((1.0, 0.0, 10.0), (0.0, 1.0, -2.0)), "z", 0.0, 0)
"""The source's axes lie 10 m to the left of the plan's, and 2 m above."""

CLERK = """
import sys
from pathlib import Path
from houseexpo.service.review.decisions import DecisionStore
file, reviewer, count = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
decisions = DecisionStore(file)
for i in range(count):
    line = decisions.decide(f"{reviewer}_{i}", "no_room", reviewer, [float(i), 1.0])
    print(line.plan, flush=True)
"""


def judged_later(folder: Path, qualities: dict[str, float | None]) -> Path:
    """Write plans of these qualities, None: without one and without a frame; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for i, (name, score) in enumerate(qualities.items()):
        if score is None:
            plan = FloorPlan(name, [(0.1, 0.1), (0.1, 4.1), (5.1 + i, 4.1), (5.1 + i, 0.1)], 1, {})
        else:
            plan = replace(two_rooms(name, 5.0 + i), quality=Quality(score, {"cut_share": 0.5}), frame=FRAME)
        save_plan(plan, folder / f"{name}.json")
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


# A web server on this machine that misbehaves as it is told.


class Served:
    """Files by name; ``cut`` answers break off half way, ``corrupt`` ones have a wrong byte, then all goes well."""

    def __init__(self, files: dict[str, bytes]) -> None:
        self.files, self.cut, self.corrupt, self.ranges = files, 0, 0, True
        self.requests: list[tuple[str, str | None]] = []
        self.address = ""


@contextmanager
def serving(files: dict[str, bytes]) -> Iterator[Served]:
    served = Served(files)

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            name, wanted = self.path.lstrip("/"), self.headers["Range"]
            served.requests.append((name, wanted))
            data = served.files.get(name)
            if data is None:
                self.send_error(404)
                return
            start = int(wanted.removeprefix("bytes=").rstrip("-")) if wanted and served.ranges else 0
            body = data[start:]
            if served.corrupt:
                served.corrupt -= 1
                body = bytes([body[0] ^ 1]) + body[1:]
            self.send_response(206 if start else 200)
            if start:
                self.send_header("Content-Range", f"bytes {start}-{len(data) - 1}/{len(data)}")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            if served.cut:
                served.cut -= 1
                self.wfile.write(body[: len(body) // 2])
                self.wfile.flush()
                self.close_connection = True
            else:
                self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    served.address = f"http://127.0.0.1:{server.server_address[1]}"
    try:
        yield served
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
