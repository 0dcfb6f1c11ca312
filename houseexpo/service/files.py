"""Scripts and styles: read once when the service starts, served by name; nothing else of the disk can be reached."""

from __future__ import annotations

import hashlib
from importlib.resources import files
from typing import Final

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.service.caching import matches
from houseexpo.service.service import PARTS, Service

_TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
    ".webmanifest": "application/manifest+json",
}


def routes(service: Service) -> list[BaseRoute]:  # noqa: ARG001  # every area is called alike
    """Return the route of ``/static/NAME`` and ``/static/PART/NAME``."""
    known = {name: (data, kind, f'"{hashlib.sha256(data).hexdigest()[:20]}"') for name, data, kind in _found()}

    async def static(request: Request) -> Response:
        found = known.get(request.path_params["name"])
        if found is None:
            raise HTTPException(404, "no such file")
        data, kind, etag = found
        headers = {"etag": etag, "cache-control": "no-cache"}
        if matches(request, etag):
            return Response(status_code=304, headers=headers)
        return Response(data, headers=headers, media_type=kind)

    return [Route("/static/{name:path}", static)]


def _found() -> list[tuple[str, bytes, str]]:
    found = []
    for prefix, package in (("", "houseexpo.service"), *((f"{part}/", f"houseexpo.service.{part}") for part in PARTS)):
        for file in files(package).joinpath("static").iterdir():
            kind = _TYPES.get("." + file.name.rpartition(".")[2])
            if kind is not None:
                found.append((prefix + file.name, file.read_bytes(), kind))
    return found
