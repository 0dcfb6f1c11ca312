"""Drive a robot through any plan in the browser, or watch explorers, while PseudoSLAM builds the map.

This serves ``/DATA/drive``, the page for driving or watching, and a web socket for each robot.
"""

from __future__ import annotations

import secrets
from typing import Any, Final

import anyio
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket

from houseexpo.processes import count_cores
from houseexpo.service.service import Service

MAX_ROBOTS: Final = 16
"""The largest number of robots on a server; each needs some megabytes and thirty steps per second."""

EXPLORERS: Final = {
    "random": "moves at random",
    "spin": "turns on the spot",
    "forward": "goes straight, turns at walls",
    "wall": "follows walls",
    "frontier": "nearest frontier",
    "random-frontier": "frontiers at random",
    "frontier-mapex": "frontier nearest by the straight line, kept",
    "information": "much to see, and near",
    "prospector": "most to see per metre",
    "tour": "shortest tour of frontiers",
    "chooser": "learned choice of frontiers",
    "chooser-1": "trained with another seed",
    "chooser-2": "trained with a third seed",
    "finisher": "learned for short ways to the end",
    "look-around": "the same, and looks round as it goes",
    "swift": "learned choice, and turns as it goes",
    "straight": "looks round, and goes straight to what it chose",
    "oracle": "knows the house",
}
"""The explorers, described in a few words."""


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/drive``."""
    robots: list[int] = []
    threads: list[anyio.CapacityLimiter] = []

    def page(request: Request) -> Response:
        from houseexpo.service.drive.robots import explorer_names  # it brings numba

        shown = service.collection(request)
        if not len(shown.dataset):
            raise HTTPException(404, f"{shown.name} has no plans")
        ids = shown.dataset.ids
        asked = request.query_params.get("plan")
        name = asked if asked is not None else ids[0]
        if name not in shown.dataset:
            raise HTTPException(404, f"{shown.name} has no plan {name!r}")
        now = shown.now
        plan, words = now.plan(name), now.views.table.title(now.numbers[name])
        other = secrets.choice(ids)
        known = [(explorer, EXPLORERS.get(explorer, "")) for explorer in explorer_names()]
        told: dict[str, Any] = {
            "plan": plan,
            "words": words,
            "other": other if other != name else "",
            "explorers": known,
            "policies": list(service.settings.policies),
        }
        return service.page(request, "drive/drive.html", here="drive", shown=shown, **told)

    async def socket(websocket: WebSocket) -> None:
        from houseexpo.service.drive.sessions import FULL, DriveSocket

        found = service.collections.get(websocket.path_params["data"])
        if found is None:
            await websocket.close(1008, "no such data set")
            return
        await websocket.accept()
        if len(robots) >= MAX_ROBOTS:
            text = f"{MAX_ROBOTS} robots are already driving; wait until one of them is done"
            await websocket.send_json({"error": text})
            await websocket.close(FULL, text)
            return
        robots.append(1)
        try:
            if not threads:
                threads.append(anyio.CapacityLimiter(count_cores()))
            await DriveSocket(websocket, found.plan, threads[0], service.settings.policies).run()
        finally:
            robots.pop()

    return [Route("/{data}/drive", page), WebSocketRoute("/{data}/drive/robot", socket)]
