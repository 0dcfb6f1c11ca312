"""Open, select, split, fetch and validate data sets of plans."""

from houseexpo.dataset.dataset import Dataset, Range, open_dataset

__all__ = ["Dataset", "Range", "open_dataset"]
