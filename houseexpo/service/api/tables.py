"""Tables as Parquet files, of which readers fetch the parts that they need."""

from __future__ import annotations

from pathlib import Path

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.service.caching import on_disk, ranged, values
from houseexpo.service.service import Service

PARQUET = "application/vnd.apache.parquet"


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    def index(request: Request) -> Response:
        data, tag = service.collection(request).now.index
        return ranged(request, data, tag, PARQUET)

    def tables(request: Request) -> Response:
        return values(request, {"tables": sorted(_files(service.collection(request).path))})

    def table(request: Request) -> Response:
        files = _files(service.collection(request).path)
        file = files.get(request.path_params["name"])
        if file is None:
            raise HTTPException(404, f"no such table; there are: {', '.join(sorted(files)) or 'none'}")
        return on_disk(request, file, PARQUET)

    return [
        Route("/api/{data}/index.parquet", index),
        Route("/api/{data}/tables", tables),
        Route("/api/{data}/tables/{name}", table),
    ]


def _files(path: Path) -> dict[str, Path]:
    """Return the Parquet files of a data set's folder, by name; links lead elsewhere and are left out."""
    if not path.is_dir():
        return {}
    return {file.name: file for file in path.glob("*.parquet") if file.is_file() and not file.is_symlink()}
