"""One plan: its JSON as it is packed, its pictures, its files in other formats."""

from __future__ import annotations

from typing import Final
from urllib.parse import quote

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.drawing import svg
from houseexpo.exports import FORMATS
from houseexpo.files import as_zip
from houseexpo.floorplan import FloorPlan
from houseexpo.service.caching import hashed
from houseexpo.service.service import Service
from houseexpo.service.work import computed

_TYPES: Final = {
    "json": "application/json",
    "geojson": "application/geo+json",
    "svg": "image/svg+xml",
    "png": "image/png",
    "glb": "model/gltf-binary",
    "zip": "application/zip",
    "graphml": "application/xml",
}
_ALONE: Final = "default-src 'none'; style-src 'unsafe-inline'; sandbox"
"""What a picture may do that is opened as a page of its own."""


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    def raw(request: Request) -> Response:
        now = service.collection(request).now
        data = now.data.raw(now.known(request.path_params["plan"]))
        return hashed(request, data, "application/json")

    async def thumbnail(request: Request) -> Response:
        shown, name = service.collection(request), request.path_params["plan"]
        data = shown.thumbnail(name)
        if data is None:
            data = await run_in_threadpool(shown.drawn, name)
        return hashed(request, data, "image/svg+xml", {"cache-control": "max-age=60"})

    async def picture(request: Request) -> Response:
        now = service.collection(request).now
        name = now.known(request.path_params["plan"])
        data = (await computed(request, lambda: svg(now.plan(name)))).encode()
        return hashed(request, data, "image/svg+xml", {"content-security-policy": _ALONE})

    def stages(request: Request) -> Response:
        now = service.collection(request).now
        data = now.data.stages(now.known(request.path_params["plan"]))
        if data is None:
            raise HTTPException(404, "the build kept no picture of its stages; houseexpo build --keep-stages does")
        return hashed(request, data, "image/png")

    async def export(request: Request) -> Response:
        now, form = service.collection(request).now, request.path_params["form"]
        plan = now.known(request.path_params["plan"])
        if form not in FORMATS:
            raise HTTPException(404, f"no format {form[:40]!r}; there are: {', '.join(FORMATS)}")
        name, data = await computed(request, lambda: exported(now.plan(plan), form))
        kind = _TYPES.get(name.rpartition(".")[2], "application/octet-stream")
        attached = {"content-disposition": f"attachment; filename*=utf-8''{quote(name, safe='')}"}
        return hashed(request, data, kind, {**attached, "content-security-policy": _ALONE})

    return [
        Route("/api/{data}/plans/{plan}", raw),
        Route("/api/{data}/plans/{plan}/thumbnail.svg", thumbnail),
        Route("/api/{data}/plans/{plan}/picture.svg", picture),
        Route("/api/{data}/plans/{plan}/stages.png", stages),
        Route("/api/{data}/plans/{plan}/export/{form}", export),
    ]


def exported(plan: FloorPlan, form: str) -> tuple[str, bytes]:
    """Return a plan in a format: the file's name and its bytes; several files as a ZIP archive."""
    files = dict(FORMATS[form].files([plan]))
    if len(files) == 1:
        name, data = next(iter(files.items()))
        return name.rpartition("/")[2], data
    return f"{plan.id}-{form}.zip", as_zip(files)
