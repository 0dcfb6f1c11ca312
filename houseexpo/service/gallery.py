"""The gallery of a data set: its plans as pictures, filtered and sorted."""

from __future__ import annotations

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.service.service import Service


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/DATA/``."""

    async def gallery(request: Request) -> Response:
        shown = service.collection(request)
        return service.page(request, "gallery.html", shown=shown, here="gallery")

    return [Route("/{data}/", gallery)]
