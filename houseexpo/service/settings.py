"""How the service is run, and how much it lets one client do."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from typing import Final

LOOPBACK: Final = "127.0.0.1"
_LOCAL: Final = frozenset({"localhost", "127.0.0.1", "::1"})
_ANY: Final = frozenset({"0.0.0.0", "::"})  # noqa: S104  # compared with, not bound to


@dataclass(frozen=True)
class Limits:
    """What one server takes at most; a client is an address."""

    body_bytes: int = 1 << 20
    requests_per_s: float = 1500.0
    burst: int = 3000
    sockets: int = 64
    sockets_per_client: int = 16
    message_bytes: int = 1 << 16
    """Of one message that comes in over a socket."""


@dataclass(frozen=True)
class Settings:
    """How the service is run.

    Attributes
    ----------
    host, port
        Where it listens.
    names
        More names by which clients may call it.
    read_only
        Nothing is written: neither decisions nor runs of a robot.
    review
        Pages for judging plans are there.
    token
        What clients have to show, or "" if none is asked for.
    """

    host: str = LOOPBACK
    port: int = 8000
    names: tuple[str, ...] = ()
    read_only: bool = False
    review: bool = False
    token: str = ""
    limits: Limits = Limits()

    def knows(self, host: str) -> bool:
        """Whether a Host header (without its port) names this server.

        Another name that leads here is an attack on browsers (DNS rebinding). Addresses cannot be rebound; so where
        the server listens on all of them, any address is its name.
        """
        name = host.strip("[]").lower().rstrip(".")
        if name in {*_LOCAL, self.host.lower(), *map(str.lower, self.names)}:
            return True
        return is_any(self.host) and _is_address(name)


def is_any(host: str) -> bool:
    """Whether what listens there listens on all addresses of the machine."""
    return host in _ANY


def is_loopback(host: str) -> bool:
    """Whether only this machine can reach what listens there."""
    return host == "localhost" or (_is_address(host) and ipaddress.ip_address(host).is_loopback)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
