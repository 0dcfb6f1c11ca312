"""Drive a robot in any plan in the browser, or watch explorers: the map grows as PseudoSLAM makes it."""

from houseexpo.service.drive.pages import routes

__all__ = ["routes"]
