"""Where the plans of a data set come from, and the caches that make them quick to reach."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from houseexpo.dataset.store.catalogue import Catalogue


def address_in(place: str | os.PathLike[str]) -> str:
    """Return the address that this is, "" where it is a path; a ``Path`` of an address has lost one of its slashes."""
    found = re.match("(https?):/+(.*)", os.fspath(place))
    return f"{found[1]}://{found[2]}" if found else ""


def opened(place: str | os.PathLike[str]) -> Catalogue:
    """Open what lies at a path, or what a service offers at an address."""
    address = address_in(place)
    if address:
        from houseexpo.dataset.store.remote import open_remote

        return open_remote(address)
    from houseexpo.dataset.store.catalogue import open_catalogue

    return open_catalogue(Path(place))
