"""The application: every area's routes behind one guard."""

from __future__ import annotations

from typing import Final

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from houseexpo.errors import HouseExpoError
from houseexpo.service import about, api, compare, drive, files, gallery, likeness, plan, refused, review, statistics
from houseexpo.service.answers import refused_request
from houseexpo.service.safety import Guard
from houseexpo.service.service import Service
from houseexpo.service.work import few_threads

AREAS: Final = (about, refused, statistics, compare, likeness, api, review, drive, plan, gallery)
"""Modules with ``routes(service)``. A path of one that comes earlier goes before a pattern of a later one."""


def make_app(service: Service) -> Starlette:
    """Return the application of a service, ready for a server or a test client."""

    async def failed(request: Request, error: Exception) -> Response:
        return refused_request(service, request, error)

    routes = files.routes(service)
    for area in AREAS:
        routes += area.routes(service)
    app = Starlette(
        routes=routes,
        exception_handlers={HTTPException: failed, HouseExpoError: failed, Exception: failed},
        lifespan=few_threads,
        max_body_size=service.settings.limits.body_bytes,
    )
    app.middleware_stack = Guard(app.build_middleware_stack(), service.settings)
    return app
