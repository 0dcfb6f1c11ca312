"""Write a data set as a folder that is ready to upload: tables, archive, descriptions, data card, checksums."""

from houseexpo.release.check_releasable import PublisherTexts
from houseexpo.release.write_release import FinishedRelease, release

__all__ = ["FinishedRelease", "PublisherTexts", "release"]
