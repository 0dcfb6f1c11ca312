"""Judge plans in the browser: the doubtful ones first; what is decided goes to ``overrides.toml`` and to a log."""

from houseexpo.service.review.pages import routes

__all__ = ["routes"]
