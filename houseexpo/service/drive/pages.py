"""The routes of drive: a page, and a socket for each robot."""

from __future__ import annotations

from typing import Final

import anyio
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket

from houseexpo.service.service import Service
from houseexpo.workers import cores

MAX_ROBOTS: Final = 16
"""At once, on one server: each takes some megabytes, and thirty steps a second."""


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/drive``."""
    robots: list[int] = []
    threads: list[anyio.CapacityLimiter] = []

    def page(request: Request) -> Response:
        from houseexpo.service.drive.robots import explorers  # it brings numba

        shown = service.collection(request)
        if not len(shown.dataset):
            raise HTTPException(404, f"{shown.name} has no plans")
        asked = request.query_params.get("plan")
        plan = asked if asked is not None else shown.dataset.ids[0]
        if plan not in shown.dataset:
            raise HTTPException(404, f"{shown.name} has no plan {plan!r}")
        return service.page(request, "drive/drive.html", here="drive", shown=shown, explorers=explorers(), plan=plan)

    async def socket(websocket: WebSocket) -> None:
        from houseexpo.service.drive.sessions import FULL, Session

        found = service.collections.get(websocket.path_params["data"])
        if found is None:
            await websocket.close(1008, "no such data set")
            return
        await websocket.accept()
        if len(robots) >= MAX_ROBOTS:
            text = f"{MAX_ROBOTS} robots drive here already; wait until one of them is done"
            await websocket.send_json({"error": text})
            await websocket.close(FULL, text)
            return
        robots.append(1)
        try:
            if not threads:
                threads.append(anyio.CapacityLimiter(cores()))
            await Session(websocket, found.plan, threads[0]).run()
        finally:
            robots.pop()

    return [Route("/{data}/drive", page), WebSocketRoute("/{data}/drive/robot", socket)]
