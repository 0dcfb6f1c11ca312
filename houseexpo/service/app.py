"""Build the web application (ASGI) of the service: the routes of all areas, behind one guard."""

from __future__ import annotations

from typing import Any, Final

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

from houseexpo.errors import HouseExpoError
from houseexpo.service import (
    api,
    dataset_pages,
    drive,
    plan_page,
    review,
)
from houseexpo.service.api import add_query_check
from houseexpo.service.computations import limit_threads
from houseexpo.service.guard import Guard
from houseexpo.service.responses import error_response
from houseexpo.service.service import PARTS, Service

AREAS: Final = (api, review, drive, plan_page, dataset_pages)
"""Modules with ``routes(service)``. A fixed path must come before a pattern that also matches it."""


class _Files(StaticFiles):
    """Scripts and styles of a package; browsers ask each time whether a file has changed."""

    def file_response(self, *args: Any, **kwargs: Any) -> Response:
        """Return a file, or 304 if the browser has it."""
        found = super().file_response(*args, **kwargs)
        found.headers["cache-control"] = "no-cache"
        return found


def make_app(service: Service) -> Starlette:
    """Return the application of a service, ready for a server or a test client."""

    async def answer_error(request: Request, error: Exception) -> Response:
        return error_response(service, request, error)

    async def answer_nobody(_: Request, __: Exception) -> Response:
        return Response(status_code=400)  # the client left in the middle of its body

    folders = {f"/static/{part}": f"houseexpo.service.{part}" for part in PARTS} | {"/static": "houseexpo.service"}
    routes: list[BaseRoute] = [Mount(path, _Files(packages=[(package, "static")])) for path, package in folders.items()]
    for area in AREAS:
        routes += area.routes(service)
    for route in routes:
        if isinstance(route, Route) and route.path.startswith("/api/"):
            add_query_check(route)
    app = Starlette(
        routes=routes,
        exception_handlers={
            ClientDisconnect: answer_nobody,
            HTTPException: answer_error,
            HouseExpoError: answer_error,
            Exception: answer_error,
        },
        lifespan=limit_threads,
        max_body_size=service.settings.limits.body_bytes,
    )
    app.middleware_stack = Guard(app.build_middleware_stack(), service.settings)
    return app
