"""Review plans in the browser, doubtful plans first; decisions go to ``overrides.toml`` and to a log."""

from houseexpo.service.review.pages import routes

__all__ = ["routes"]
