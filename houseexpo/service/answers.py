"""Bodies of requests, read; and the answer to one that cannot be met.

That is a page for people and JSON for programs, never a traceback.
"""

from __future__ import annotations

import logging
from typing import Any, Final, TypeVar

import msgspec
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response

from houseexpo.errors import ConfigError, HouseExpoError, PlanError, UnknownPlanError
from houseexpo.service.service import Service

Asked = TypeVar("Asked")

_LOG = logging.getLogger(__name__)

_TITLES: Final = {
    400: "This cannot be asked for",
    403: "Not allowed",
    404: "Not here",
    405: "Not possible here",
    413: "Too large",
    503: "Not now",
}


class Json(Response):
    """Plain values as JSON."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        """Encode the values."""
        return msgspec.json.encode(content)


def read(body: bytes, kind: type[Asked]) -> Asked:
    """Read what a browser sent; raise ConfigError if it is something else."""
    try:
        return msgspec.json.decode(body, type=kind)
    except msgspec.DecodeError as error:
        raise ConfigError(f"request: expected {kind.__name__} as JSON, found {error}") from None


def refused_request(service: Service, request: Request, error: Exception) -> Response:
    """Say what went wrong, as a page where a browser asks for one, else and below ``/api`` as ``{"error": ...}``."""
    status, text = _said(error)
    shown = service.collections.get(request.path_params.get("data", ""))
    if shown is not None and shown.path.is_absolute():
        text = text.replace(f"{shown.path.parent}/", "")  # where it lies is no business of clients
    if status == 500:
        _LOG.error("%s %s failed", request.method, request.url.path, exc_info=error)
    headers = getattr(error, "headers", None)
    if request.url.path.startswith("/api/") or "text/html" not in request.headers.get("accept", ""):
        return Json({"error": text}, status, headers)
    title = _TITLES.get(status, "Something went wrong")
    page = service.page(request, "error.html", status, title=title, text=text, shown=shown)
    page.headers.update(headers or {})
    return page


def _said(error: Exception) -> tuple[int, str]:
    if isinstance(error, HTTPException):
        return error.status_code, error.detail
    if isinstance(error, UnknownPlanError):
        return 404, str(error)
    if isinstance(error, ConfigError):
        return 400, str(error)
    if isinstance(error, PlanError):
        return 422, str(error)
    if isinstance(error, HouseExpoError):  # a plan that was deleted or changed while it is shown
        return 503, str(error)
    return 500, "The server met an error; its log says more. The other pages go on."
