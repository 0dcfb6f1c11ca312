"""A data set as a folder that can be uploaded as it is: tables, archive, descriptions, data card, checksums."""

from houseexpo.release.about import About
from houseexpo.release.run import Released, release

__all__ = ["About", "Released", "release"]
