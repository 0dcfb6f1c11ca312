"""Store and read plans, and pictures of their stages, as bytes; data sets are assembled from them.

Each lies under the SHA-256 of its bytes, so that two writers agree.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pipeline.batch.entry import PlanRecord, StoredPicture

if TYPE_CHECKING:  # how a store is kept shows in no plan: it is no part of what a result depends on
    from pipeline.batch.result_store import Store

_FOLDER = ".build/plans"


class DamagedPlanError(Exception):
    """A plan in the store, or the picture of its stages, is gone or no longer what was written."""

    def __init__(self, kept: PlanRecord) -> None:
        super().__init__(kept)
        self.kept = kept


@dataclass(frozen=True)
class PlanStore:
    """The plans in a store, in subfolders by the first two digits of their hash."""

    store: Store

    def put(self, name: str, content: str, data: bytes, picture: bytes = b"") -> PlanRecord:
        """Store a plan, and the picture of its stages if there is one. ``get`` detects files that a crash damaged."""
        stages = StoredPicture(self._add(picture), len(picture)) if picture else None
        return PlanRecord(name, content, self._add(data), len(data), stages)

    def stands(self, kept: PlanRecord, *, pictured: bool) -> bool:
        """Tell whether a plan (and, if ``pictured``, its picture) is stored with its size; nothing is read."""
        if self.store.size(_place(kept.plan)) != kept.size:
            return False
        stages = kept.stages
        return not pictured or (stages is not None and self.store.size(_place(stages.sha256)) == stages.size)

    def get(self, kept: PlanRecord) -> bytes:
        """Return the bytes of a plan.

        Raises
        ------
        DamagedPlanError
            Where they are not what was kept; what is there is removed, so that it can be kept again.
        """
        return self._get(kept, kept.plan)

    def picture(self, kept: PlanRecord) -> bytes:
        """Return the picture of a plan's stages, or b"" without one. Raises DamagedPlanError as ``get`` does."""
        return b"" if kept.stages is None else self._get(kept, kept.stages.sha256)

    def sweep(self) -> None:
        """Remove the remains of interrupted writes."""
        self.store.sweep(_FOLDER)

    def _add(self, data: bytes) -> str:
        sha256 = hashlib.sha256(data).hexdigest()
        self.store.add(_place(sha256), data)
        return sha256

    def _get(self, kept: PlanRecord, sha256: str) -> bytes:
        try:
            data = self.store.get(_place(sha256))
        except OSError:
            raise DamagedPlanError(kept) from None
        if hashlib.sha256(data).hexdigest() != sha256:
            self.store.remove(_place(sha256))
            raise DamagedPlanError(kept)
        return data


def stored_names(kept: PlanRecord) -> list[str]:
    """Return the names under which a plan, and the picture of its stages, are kept."""
    return [_place(kept.plan), *([_place(kept.stages.sha256)] if kept.stages is not None else [])]


def _place(sha256: str) -> str:
    return f"{_FOLDER}/{sha256[:2]}/{sha256}"
