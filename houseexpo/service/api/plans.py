"""Serve plans below ``/api``: a plan's JSON as stored, its pictures, and one or several plans in other formats."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final
from urllib.parse import quote

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.drawing import svg
from houseexpo.errors import ConfigError, PlanError
from houseexpo.exports import FORMATS
from houseexpo.files import zip_bytes
from houseexpo.floorplan import FloorPlan
from houseexpo.service.computations import compute_in_turn
from houseexpo.service.responses import hash_tagged_response
from houseexpo.service.search import parse_query
from houseexpo.service.service import Service

_TYPES: Final = {
    "json": "application/json",
    "geojson": "application/geo+json",
    "svg": "image/svg+xml",
    "png": "image/png",
    "glb": "model/gltf-binary",
    "zip": "application/zip",
    "graphml": "application/xml",
}
MOST_EXPORTED: Final = 500
"""The largest number of plans in a download."""

_ALONE: Final = "default-src 'none'; style-src 'unsafe-inline'; sandbox"
"""The permissions of a picture that is opened as its own page."""


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    def raw(request: Request) -> Response:
        now = service.collection(request).now
        data = now.data.raw(now.check_id(request.path_params["plan"]))
        return hash_tagged_response(request, data, "application/json")

    async def thumbnail(request: Request) -> Response:
        shown, name = service.collection(request), request.path_params["plan"]
        data = shown.thumbnail(name)
        if data is None:
            data = await run_in_threadpool(shown.draw_thumbnail, name)
        return hash_tagged_response(request, data, "image/svg+xml", {"cache-control": "max-age=60"})

    async def picture(request: Request) -> Response:
        now = service.collection(request).now
        name = now.check_id(request.path_params["plan"])
        data = (await compute_in_turn(request, lambda: svg(now.plan(name)))).encode()
        return hash_tagged_response(request, data, "image/svg+xml", {"content-security-policy": _ALONE})

    def stages(request: Request) -> Response:
        now = service.collection(request).now
        data = now.data.stages(now.check_id(request.path_params["plan"]))
        if data is None:
            raise HTTPException(404, "the build kept no picture of its stages; use houseexpo build --keep-stages")
        return hash_tagged_response(request, data, "image/png")

    async def export(request: Request) -> Response:
        now, form = service.collection(request).now, request.path_params["form"]
        plan = now.check_id(request.path_params["plan"])
        if form not in FORMATS:
            raise HTTPException(404, f"no format {form[:40]!r}; the formats: {', '.join(FORMATS)}")
        name, data = await compute_in_turn(request, lambda: export_plan(now.plan(plan), form))
        kind = _TYPES.get(name.rpartition(".")[2], "application/octet-stream")
        attached = {"content-disposition": f"attachment; filename*=utf-8''{quote(name, safe='')}"}
        return hash_tagged_response(request, data, kind, {**attached, "content-security-policy": _ALONE})

    async def exports(request: Request) -> Response:
        form, ids = request.path_params["form"], request.query_params.get("ids", "")
        now, found = service.collection(request).find(parse_query(request.query_params, ("ids",)))
        names = [now.check_id(name) for name in ids.split(",") if name]
        names = names or [now.views.table.ids[row] for row in found.rows.tolist()]
        if form not in FORMATS:
            raise HTTPException(404, f"no format {form[:40]!r}; the formats: {', '.join(FORMATS)}")
        if not 0 < len(names) <= MOST_EXPORTED:
            text = f"export: expected 1 to {MOST_EXPORTED} plans, found {len(names):,}; narrow the filter"
            raise ConfigError(f"{text}, or save the list of ids and run: houseexpo export --ids LIST")
        name = request.path_params["data"]
        data = await compute_in_turn(request, lambda: zip_bytes(_files((now.plan(each) for each in names), form)))
        attached = {"content-disposition": f"attachment; filename*=utf-8''{quote(name, safe='')}-{form}.zip"}
        return hash_tagged_response(request, data, _TYPES["zip"], attached)

    return [
        Route("/api/{data}/export/{form}", exports),
        Route("/api/{data}/plans/{plan}", raw),
        Route("/api/{data}/plans/{plan}/thumbnail.svg", thumbnail),
        Route("/api/{data}/plans/{plan}/picture.svg", picture),
        Route("/api/{data}/plans/{plan}/stages.png", stages),
        Route("/api/{data}/plans/{plan}/export/{form}", export),
    ]


def _files(plans: Iterable[FloorPlan], form: str) -> dict[str, bytes]:
    """Return the files of plans in a format; a plan that the format cannot hold is named in ``left-out.txt``."""
    if FORMATS[form].indexed:
        return dict(FORMATS[form].files(plans))
    found: dict[str, bytes] = {}
    left: list[str] = []
    for plan in plans:
        try:
            found.update(FORMATS[form].files([plan]))
        except PlanError as error:
            left.append(f"{error}\n")
    return {**found, "left-out.txt": "".join(left).encode()} if left else found


def export_plan(plan: FloorPlan, form: str) -> tuple[str, bytes]:
    """Return a plan in a format: the file's name and its bytes; several files as a ZIP archive."""
    files = dict(FORMATS[form].files([plan]))
    if len(files) == 1:
        name, data = next(iter(files.items()))
        return name.rpartition("/")[2], data
    return f"{plan.id}-{form}.zip", zip_bytes(files)
