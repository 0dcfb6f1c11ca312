"""Stage dedupe: over all plans of a build, keep one of each group that is the same house.

The comparison is ``houseexpo.similarity``'s: |A xor B| / max(|A|, |B|) of free pixels under the eight symmetries of the
square; this stage only groups.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from houseexpo.raster import Mask
from houseexpo.similarity import Duplicate, find_duplicates
from pipeline.config import DedupeConfig


def dedupe(masks: Mapping[str, Mask], config: DedupeConfig, keep: Collection[str] = ()) -> list[Duplicate]:
    """Return the plans to drop, sorted by id.

    1. Of each group, the first in the order of ids is kept.
    2. A plan in ``keep`` is never dropped: a person said so.

    Parameters
    ----------
    masks
        Free pixels of each plan by id, as ``houseexpo.similarity.comparison_mask`` makes them at
        ``config.pixels_per_metre``.
    """
    found = find_duplicates(masks, config.threshold, config.pixels_per_metre)  # R1
    return [duplicate for duplicate in found if duplicate.id not in keep]  # R2
