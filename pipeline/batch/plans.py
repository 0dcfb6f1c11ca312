"""Where plans are kept until they are put together: under the SHA-256 of their bytes, so that two writers agree."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from pipeline.batch import disk
from pipeline.batch.entry import Kept


class DamagedPlanError(Exception):
    """A plan in the store is gone, or no longer what was written."""

    def __init__(self, kept: Kept) -> None:
        super().__init__(kept)
        self.kept = kept


@dataclass(frozen=True)
class Plans:
    """A folder of plans, in subfolders by the first two digits of their hash."""

    folder: Path

    def put(self, name: str, content: str, data: bytes) -> Kept:
        """Keep a plan; it is on the disk when this returns."""
        kept = Kept(name, content, hashlib.sha256(data).hexdigest(), len(data))
        if not self.stands(kept):
            file = self._file(kept)
            file.parent.mkdir(parents=True, exist_ok=True)
            disk.write(file, data)
        return kept

    def stands(self, kept: Kept) -> bool:
        """Tell whether a plan is there in its size; nothing is read."""
        try:
            return self._file(kept).stat().st_size == kept.size
        except OSError:
            return False

    def get(self, kept: Kept) -> bytes:
        """Return the bytes of a plan.

        Raises
        ------
        DamagedPlanError
            Where they are not what was kept; what is there is removed, so that it can be kept anew.
        """
        try:
            data = self._file(kept).read_bytes()
        except OSError:
            raise DamagedPlanError(kept) from None
        if hashlib.sha256(data).hexdigest() != kept.plan:
            self._file(kept).unlink(missing_ok=True)
            raise DamagedPlanError(kept)
        return data

    def sweep(self) -> None:
        """Remove what interrupted writes left."""
        for folder in self.folder.glob("*/"):
            disk.sweep(folder)

    def _file(self, kept: Kept) -> Path:
        return self.folder / kept.plan[:2] / kept.plan
