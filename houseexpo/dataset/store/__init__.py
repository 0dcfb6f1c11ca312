"""Where the plans of a data set come from, and the caches that make them quick to reach."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from houseexpo.errors import DatasetError

if TYPE_CHECKING:
    from houseexpo.dataset.store.catalogue import Catalogue


def address_in(place: str | os.PathLike[str]) -> str:
    """Return the address that this is, "" where it is a path; a ``Path`` of an address has lost one of its slashes."""
    found = re.match("(https?):/+(.*)", os.fspath(place), re.IGNORECASE)
    return f"{found[1].lower()}://{found[2]}" if found else ""


def files_at(place: str | os.PathLike[str], what: str) -> Path:
    """Return a path of this machine; DatasetError where it is a service's address, and ``what`` needs files."""
    address = address_in(place)
    if address:
        shown = address.partition("?")[0]  # behind it stands the token
        raise DatasetError(f"{shown}: {what} needs the files of a data set; run it where houseexpo serve runs")
    return Path(place)


def opened(place: str | os.PathLike[str]) -> Catalogue:
    """Open what lies at a path, or what a service offers at an address."""
    address = address_in(place)
    if address:
        from houseexpo.dataset.store.remote import open_remote

        return open_remote(address)
    from houseexpo.dataset.store.catalogue import open_catalogue

    return open_catalogue(Path(place))
