"""Where the plans of a data set come from, and the caches that make them quick to reach."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from houseexpo.dataset.store.catalogue import Catalogue


def opened(place: str | os.PathLike[str]) -> Catalogue:
    """Open what lies at a path, or what a service offers at an address."""
    if isinstance(place, str) and place.startswith(("http://", "https://")):
        from houseexpo.dataset.store.remote import open_remote

        return open_remote(place)
    from houseexpo.dataset.store.catalogue import open_catalogue

    return open_catalogue(Path(place))
