"""Hold what every page uses: the data sets by name, the server's settings and limits for clients, and the templates."""

from __future__ import annotations

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from jinja2 import ChoiceLoader, Environment, PackageLoader, PrefixLoader, StrictUndefined
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import HTMLResponse

from houseexpo import __version__
from houseexpo.service.collection import Collection

LOOPBACK: Final = "127.0.0.1"
_LOCAL: Final = frozenset({"localhost", "127.0.0.1", "::1"})
_ANY: Final = frozenset({"0.0.0.0", "::"})  # noqa: S104  # compared with, not bound to


@dataclass(frozen=True)
class ServerLimits:
    """Limits of a server; a client is an address."""

    body_bytes: int = 1 << 20
    sockets: int = 64
    sockets_per_client: int = 16
    message_bytes: int = 1 << 16
    """Size of an incoming message of a socket."""


@dataclass(frozen=True)
class ServiceSettings:
    """Settings of the service.

    Attributes
    ----------
    host, port
        The address on which it listens.
    names
        Further names of the server that clients may use.
    read_only
        Whether it writes no files: neither decisions nor runs of a robot.
    review
        Whether it has pages for judging plans.
    token
        The token that clients must show, "" for no token.
    policies
        The policies that drive beside the benchmark's explorers: the names for ``load_policy``, by those of drivers.
    """

    host: str = LOOPBACK
    port: int = 8000
    names: tuple[str, ...] = ()
    read_only: bool = False
    review: bool = False
    token: str = ""
    policies: Mapping[str, str] = field(default_factory=dict)
    limits: ServerLimits = ServerLimits()

    def knows(self, host: str) -> bool:
        """Return whether a Host header (without its port) names this server.

        Another name that leads here is an attack on browsers (DNS rebinding). Numeric addresses cannot be rebound, so
        that all of them are names of a server that listens on all addresses.
        """
        name = host.strip("[]").lower().rstrip(".")
        if name in {*_LOCAL, self.host.lower(), *map(str.lower, self.names)}:
            return True
        return is_any_address(self.host) and _is_address(name)


def is_any_address(host: str) -> bool:
    """Return whether a server on this host listens on all addresses of the machine."""
    return host in _ANY


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach a server on this host."""
    return host == "localhost" or (_is_address(host) and ipaddress.ip_address(host).is_loopback)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


PARTS: Final = ("review", "drive")
"""Subpackages with their own templates and files: ``review/page.html``, ``/static/review/page.js``."""


def _templates() -> Environment:
    own = PackageLoader("houseexpo.service")
    parts = PrefixLoader({part: PackageLoader(f"houseexpo.service.{part}") for part in PARTS})
    found = Environment(
        loader=ChoiceLoader([own, parts]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.globals["version"] = __version__
    return found


@dataclass(frozen=True)
class Service:
    """A service; ``collections`` are its data sets by the names in their addresses."""

    collections: Mapping[str, Collection]
    settings: ServiceSettings = field(default_factory=ServiceSettings)
    templates: Environment = field(default_factory=_templates, repr=False)

    def collection(self, request: Request) -> Collection:
        """Return the data set that a request's path names (``{data}``); raise HTTPException (404) if it is unknown."""
        name = request.path_params["data"]
        found = self.collections.get(name)
        if found is None:
            known = ", ".join(self.collections)
            raise HTTPException(404, f"no data set {name!r}; the data sets: {known}")
        found.look()
        return found

    def opening(self, request: Request, name: str) -> str:
        """Return the line of Python that opens a data set of this server; it does not contain the token."""
        address = f"{request.base_url}{name}"
        if not self.settings.token:
            return f'plans = houseexpo.open_dataset("{address}")'
        told = "# TOKEN is in the address that houseexpo serve printed"
        return f'plans = houseexpo.open_dataset("{address}?token=TOKEN")  {told}'

    def page(self, request: Request, template: str, status: int = 200, **values: Any) -> HTMLResponse:
        """Return a page from a template that extends ``base.html``, and its values.

        ``here`` names the page's own link in the navigation; ``shown`` is its data set, or None.
        """
        given = {"here": "", "shown": None, "request": request, "service": self, "settings": self.settings, **values}
        return HTMLResponse(self.templates.get_template(template).render(given), status)
