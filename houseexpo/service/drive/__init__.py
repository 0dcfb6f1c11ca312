"""Drive a robot through any plan in the browser, or watch explorers, while PseudoSLAM builds the map."""

from houseexpo.service.drive.pages import routes

__all__ = ["routes"]
