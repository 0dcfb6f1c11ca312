"""Answers with a tag, so that what did not change is not sent again; and parts of files (RFC 9110, ranges).

All that ``/api`` gives goes through one of these: ``values`` and ``hashed`` take the SHA-1 of what is sent as its tag
(a megabyte takes a millisecond), ``tagged`` and ``ranged`` a tag that is known, ``on_disk`` size and time of a file.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import msgspec
from starlette.requests import Request
from starlette.responses import FileResponse, Response

_RANGE: Final = re.compile(r"bytes=(\d{0,15})-(\d{0,15})")


def matches(request: Request, etag: str) -> bool:
    """Whether the client has the answer of this tag already (``If-None-Match``)."""
    given = request.headers.get("if-none-match", "")
    return given == "*" or etag in (tag.strip().removeprefix("W/") for tag in given.split(","))


def values(request: Request, content: Any) -> Response:
    """Return plain values as JSON."""
    return hashed(request, msgspec.json.encode(content), "application/json")


def hashed(request: Request, data: bytes, media_type: str, headers: Mapping[str, str] | None = None) -> Response:
    """Return the data under the SHA-1 of its bytes."""
    return tagged(request, data, hashlib.sha1(data, usedforsecurity=False).hexdigest(), media_type, headers)


def tagged(
    request: Request, data: bytes, tag: str, media_type: str, headers: Mapping[str, str] | None = None
) -> Response:
    """Return the data, or word that the client has it: it asks each time, so that it never shows what is old."""
    etag = f'"{tag}"'
    found = {"etag": etag, "cache-control": "no-cache", **(headers or {})}
    if matches(request, etag):
        return Response(status_code=304, headers=found)
    return Response(data, media_type=media_type, headers=found)


def ranged(request: Request, data: bytes, tag: str, media_type: str) -> Response:
    """Return the data or, where one range is asked for, that part of it; several ranges give the whole."""
    etag = f'"{tag}"'
    asked = _RANGE.fullmatch(request.headers.get("range", ""))
    other = request.headers.get("if-range", etag) != etag  # its parts are of another file
    if asked is None or asked[0] == "bytes=-" or other or matches(request, etag):
        return tagged(request, data, tag, media_type, {"accept-ranges": "bytes"})
    size = len(data)
    first, last = (max(size - int(asked[2]), 0), size - 1) if not asked[1] else (int(asked[1]), size - 1)
    if asked[1] and asked[2]:
        last = min(int(asked[2]), size - 1)
    headers = {"etag": etag, "accept-ranges": "bytes", "cache-control": "no-cache"}
    if first > last:
        return Response(status_code=416, headers={**headers, "content-range": f"bytes */{size}"})
    headers["content-range"] = f"bytes {first}-{last}/{size}"
    return Response(data[first : last + 1], 206, headers, media_type)


def on_disk(request: Request, file: Path, media_type: str) -> Response:
    """Return a file, the parts of it that are asked for, or word that the client has it."""
    found = FileResponse(file, media_type=media_type, stat_result=file.stat(), headers={"cache-control": "no-cache"})
    etag = found.headers["etag"]
    if matches(request, etag):
        return Response(status_code=304, headers={"etag": etag, "cache-control": "no-cache"})
    return found
