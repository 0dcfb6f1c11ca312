"""Answers that a browser may keep: it asks with the tag that it has, and hears that nothing changed."""

from __future__ import annotations

from starlette.requests import Request


def matches(request: Request, etag: str) -> bool:
    """Whether the client has the answer of this tag already (``If-None-Match``)."""
    given = request.headers.get("if-none-match", "")
    return given == "*" or etag in (tag.strip().removeprefix("W/") for tag in given.split(","))
