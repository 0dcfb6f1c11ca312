"""Read the bodies of requests, and answer: values as JSON, data under a tag, parts of data, and errors.

Every answer below ``/api`` has an entity tag, so that unchanged data is not sent again (RFC 9110). ``json_response``
and ``hash_tagged_response`` use the SHA-1 of the data as the tag (a millisecond per megabyte), ``tagged_response`` and
``range_response`` a tag that is already known, and ``file_response`` the size and time of a file. An error becomes a
page for people and JSON for programs, never a traceback.
"""

from __future__ import annotations

import hashlib
import logging
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeVar

import msgspec
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, Response

from houseexpo.errors import ConfigError, HouseExpoError, PlanError, UnknownPlanError
from houseexpo.service.service import Service

Asked = TypeVar("Asked")

_LOG = logging.getLogger(__name__)
_RANGE: Final = re.compile(r"bytes=(\d{0,15})-(\d{0,15})")
_TITLES: Final = {
    400: "The request cannot be read",
    403: "Not allowed",
    404: "Not found",
    405: "Not possible here",
    413: "Too large",
    503: "Busy",
}


class JsonResponse(Response):
    """Plain values as JSON."""

    media_type = "application/json"

    def render(self, content: Any) -> bytes:
        """Encode the values."""
        return msgspec.json.encode(content)


def decode_body(body: bytes, kind: type[Asked]) -> Asked:
    """Decode the body of a request; raise ConfigError if it is not of this kind."""
    try:
        return msgspec.json.decode(body, type=kind)
    except msgspec.DecodeError as error:
        raise ConfigError(f"request: expected {kind.__name__} as JSON, found {error}") from None


def client_has_tag(request: Request, etag: str) -> bool:
    """Return whether the client already has the answer with this tag (``If-None-Match``)."""
    given = request.headers.get("if-none-match", "")
    return given == "*" or etag in (tag.strip().removeprefix("W/") for tag in given.split(","))


def json_response(request: Request, content: Any) -> Response:
    """Return plain values as JSON."""
    return hash_tagged_response(request, msgspec.json.encode(content), "application/json")


def hash_tagged_response(
    request: Request, data: bytes, media_type: str, headers: Mapping[str, str] | None = None
) -> Response:
    """Return the data, tagged with the SHA-1 of its bytes."""
    return tagged_response(request, data, hashlib.sha1(data, usedforsecurity=False).hexdigest(), media_type, headers)


def tagged_response(
    request: Request, data: bytes, tag: str, media_type: str, headers: Mapping[str, str] | None = None
) -> Response:
    """Return the data, or 304 if the client has it; clients ask each time, so that they never show old data."""
    etag = f'"{tag}"'
    found = {"etag": etag, "cache-control": "no-cache", **(headers or {})}
    if client_has_tag(request, etag):
        return Response(status_code=304, headers=found)
    return Response(data, media_type=media_type, headers=found)


def range_response(request: Request, data: bytes, tag: str, media_type: str) -> Response:
    """Return the data, or the part that the request names; a request for several parts gets all of the data."""
    etag = f'"{tag}"'
    asked = _RANGE.fullmatch(request.headers.get("range", ""))
    is_other = request.headers.get("if-range", etag) != etag  # the client's first parts are of another file
    if asked is None or asked[0] == "bytes=-" or is_other or client_has_tag(request, etag):
        return tagged_response(request, data, tag, media_type, {"accept-ranges": "bytes"})
    size = len(data)
    first, last = (max(size - int(asked[2]), 0), size - 1) if not asked[1] else (int(asked[1]), size - 1)
    if asked[1] and asked[2]:
        last = min(int(asked[2]), size - 1)
    headers = {"etag": etag, "accept-ranges": "bytes", "cache-control": "no-cache"}
    if first > last:
        return Response(status_code=416, headers={**headers, "content-range": f"bytes */{size}"})
    headers["content-range"] = f"bytes {first}-{last}/{size}"
    return Response(data[first : last + 1], 206, headers, media_type)


def file_response(request: Request, file: Path, media_type: str) -> Response:
    """Return a file, the part of it that the request names, or 304 if the client has it."""
    found = FileResponse(file, media_type=media_type, stat_result=file.stat(), headers={"cache-control": "no-cache"})
    etag = found.headers["etag"]
    if client_has_tag(request, etag):
        return Response(status_code=304, headers={"etag": etag, "cache-control": "no-cache"})
    return found


def error_response(service: Service, request: Request, error: Exception) -> Response:
    """Return an error as a page for a browser, and as ``{"error": ...}`` for programs and below ``/api``."""
    status, text = _status_and_text(error)
    shown = service.collections.get(request.path_params.get("data", ""))
    if shown is not None and shown.path.is_absolute():
        text = text.replace(f"{shown.path.parent}/", "")  # clients need not know where the data set is stored
    if status == 500:
        _LOG.error("%s %s failed", request.method, request.url.path, exc_info=error)
    headers = getattr(error, "headers", None)
    if request.url.path.startswith("/api/") or "text/html" not in request.headers.get("accept", ""):
        return JsonResponse({"error": text}, status, headers)
    title = _TITLES.get(status, "Something went wrong")
    page = service.page(request, "error.html", status, title=title, text=text, shown=shown)
    page.headers.update(headers or {})
    return page


def _status_and_text(error: Exception) -> tuple[int, str]:
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
    return 500, "The server met an error; its log has the details. Other pages still work."
