"""What our library computes of a plan: rooms, reach, ways, clearance, likeness."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan
from houseexpo.service import shapes
from houseexpo.service.caching import values
from houseexpo.service.service import Service
from houseexpo.service.similar import similar
from houseexpo.service.work import computed

_FARTHEST_M: Final = 1e6


def routes(service: Service) -> list[BaseRoute]:
    """Return the routes."""

    async def answered(request: Request, measure: Callable[[FloorPlan], Any]) -> Response:
        now = service.collection(request).now
        name = now.known(request.path_params["plan"])
        return values(request, await computed(request, lambda: measure(now.plan(name))))

    async def shape(request: Request) -> Response:
        return await answered(request, shapes.drawn)

    async def rooms(request: Request) -> Response:
        return await answered(request, lambda plan: shapes.divided(plan.divided))

    async def reach(request: Request) -> Response:
        radius = round(_metres(request.query_params, "radius", 0.2, shapes.WIDEST_M), 2)
        return await answered(request, lambda plan: shapes.reached(plan, radius))

    async def way(request: Request) -> Response:
        given = request.query_params
        radius = _metres(given, "radius", 0.2, shapes.WIDEST_M)
        ends = _point(given, "from"), _point(given, "to")
        return await answered(request, lambda plan: shapes.way(plan, *ends, radius))

    async def clearance(request: Request) -> Response:
        return await answered(request, shapes.clearance)

    async def alike(request: Request) -> Response:
        now = service.collection(request).now
        name = now.known(request.path_params["plan"])
        return values(request, {"similar": await computed(request, similar, now, name)})

    of_plan = "/api/{data}/plans/{plan}/"
    areas = {"shape": shape, "rooms": rooms, "reach": reach, "way": way, "clearance": clearance, "similar": alike}
    return [Route(of_plan + name, function) for name, function in areas.items()]


def _metres(given: Mapping[str, str], name: str, usual: float, most: float) -> float:
    """Return a length of the address, more than 0; raise ConfigError if it is none."""
    word = given.get(name, "") or str(usual)
    try:
        found = float(word[:20])
    except ValueError:
        found = math.nan
    if not 0.01 <= found <= most:
        raise ConfigError(f"{name}: expected metres, 0.01 to {most:g}, found {word[:40]!r}")
    return found


def _point(given: Mapping[str, str], name: str) -> tuple[float, float]:
    """Return a place of the address, ``x,y`` in metres."""
    words = given.get(name, "")[:60].split(",")
    try:
        x, y = map(float, words)
    except ValueError:
        x = y = math.nan
    if not (abs(x) <= _FARTHEST_M and abs(y) <= _FARTHEST_M):
        raise ConfigError(f"{name}: expected a place such as 2.5,1.0 (metres), found {given.get(name, '')[:40]!r}")
    return x, y
