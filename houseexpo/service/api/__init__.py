"""Serve ``/api``, data sets for programs; the pages use the same addresses."""

from __future__ import annotations

from starlette.routing import BaseRoute

from houseexpo.service.api import addresses, analysis, listing, plans
from houseexpo.service.service import Service


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes of ``/api``."""
    found: list[BaseRoute] = []
    for part in (addresses, listing, plans, analysis):
        found += part.routes(service)
    return found
