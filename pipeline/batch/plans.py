"""Where plans are kept until they are put together: under the SHA-256 of their bytes, so that two writers agree."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pipeline.batch.entry import Kept

if TYPE_CHECKING:  # how a store is kept shows in no plan: it is no part of what a result depends on
    from pipeline.batch.store import Store

_FOLDER = ".build/plans"


class DamagedPlanError(Exception):
    """A plan in the store is gone, or no longer what was written."""

    def __init__(self, kept: Kept) -> None:
        super().__init__(kept)
        self.kept = kept


@dataclass(frozen=True)
class Plans:
    """The plans in a store, in subfolders by the first two digits of their hash."""

    store: Store

    def put(self, name: str, content: str, data: bytes) -> Kept:
        """Keep a plan; it is safe when this returns."""
        kept = Kept(name, content, hashlib.sha256(data).hexdigest(), len(data))
        self.store.add(place_of(kept), data)
        return kept

    def stands(self, kept: Kept) -> bool:
        """Tell whether a plan is there in its size; nothing is read."""
        return self.store.size(place_of(kept)) == kept.size

    def get(self, kept: Kept) -> bytes:
        """Return the bytes of a plan.

        Raises
        ------
        DamagedPlanError
            Where they are not what was kept; what is there is removed, so that it can be kept anew.
        """
        try:
            data = self.store.get(place_of(kept))
        except OSError:
            raise DamagedPlanError(kept) from None
        if hashlib.sha256(data).hexdigest() != kept.plan:
            self.store.remove(place_of(kept))
            raise DamagedPlanError(kept)
        return data

    def sweep(self) -> None:
        """Remove what interrupted writes left."""
        self.store.sweep(_FOLDER)


def place_of(kept: Kept) -> str:
    """Return the name under which a plan is kept."""
    return f"{_FOLDER}/{kept.plan[:2]}/{kept.plan}"
