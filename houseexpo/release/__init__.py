"""Write a data set as a folder that is ready to upload: tables, archive, descriptions, data card, checksums."""

from houseexpo.release.metadata import About
from houseexpo.release.run import Released, release

__all__ = ["About", "Released", "release"]
