"""Not there yet."""

from __future__ import annotations

from starlette.routing import BaseRoute

from houseexpo.service.service import Service


def routes(service: Service) -> list[BaseRoute]:  # noqa: ARG001
    """Return no route."""
    return []
