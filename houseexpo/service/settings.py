"""Settings of the service, and the limits for its clients."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from typing import Final

LOOPBACK: Final = "127.0.0.1"
_LOCAL: Final = frozenset({"localhost", "127.0.0.1", "::1"})
_ANY: Final = frozenset({"0.0.0.0", "::"})  # noqa: S104  # compared with, not bound to


@dataclass(frozen=True)
class Limits:
    """Limits of a server; a client is an address."""

    body_bytes: int = 1 << 20
    requests_per_s: float = 1500.0
    burst: int = 3000
    sockets: int = 64
    sockets_per_client: int = 16
    message_bytes: int = 1 << 16
    """Size of an incoming message of a socket."""


@dataclass(frozen=True)
class Settings:
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
        The token that clients must show, "" for none.
    """

    host: str = LOOPBACK
    port: int = 8000
    names: tuple[str, ...] = ()
    read_only: bool = False
    review: bool = False
    token: str = ""
    limits: Limits = Limits()

    def knows(self, host: str) -> bool:
        """Return whether a Host header (without its port) names this server.

        Another name that leads here is an attack on browsers (DNS rebinding). Numeric addresses cannot be rebound, so
        that all of them are names of a server that listens on all addresses.
        """
        name = host.strip("[]").lower().rstrip(".")
        if name in {*_LOCAL, self.host.lower(), *map(str.lower, self.names)}:
            return True
        return is_any(self.host) and _is_address(name)


def is_any(host: str) -> bool:
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
