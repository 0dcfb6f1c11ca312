"""Data sets of plans: open, select, split, fetch, validate."""

from houseexpo.dataset.opening import Dataset, Range, open_dataset

__all__ = ["Dataset", "Range", "open_dataset"]
