"""Open the storage of a data set at a path or at a service's address, as a ``Catalogue``."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

from houseexpo.errors import DatasetError
from houseexpo.files import named_path

if TYPE_CHECKING:
    from houseexpo.dataset.store.catalogue import Catalogue


def address_in(place: str | os.PathLike[str]) -> str:
    """Return ``place`` if it is an address, "" if it is a path; the slash that ``Path`` drops is restored."""
    found = re.match("(https?):/+(.*)", os.fsdecode(place), re.IGNORECASE)
    return f"{found[1].lower()}://{found[2]}" if found else ""


def files_at(place: str | os.PathLike[str], what: str) -> Path:
    """Return a local path; raise DatasetError if it is a service's address, since ``what`` needs files."""
    address = address_in(place)
    if address:
        shown = address.partition("?")[0]  # the token follows it
        raise DatasetError(f"{shown}: {what} needs the files of a data set; run it where houseexpo serve runs")
    return named_path(place, what)


def open_store(place: str | os.PathLike[str]) -> Catalogue:
    """Open the data set at a path, or at the address of a service."""
    address = address_in(place)
    if address:
        from houseexpo.dataset.store.remote import open_remote

        return open_remote(address)
    from houseexpo.dataset.store.catalogue import open_catalogue

    return open_catalogue(named_path(place, "data set"))
