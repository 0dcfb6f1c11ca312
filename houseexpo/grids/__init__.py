"""Grids of cells: their place in a plan (``frame``), masks of a plan (``raster``), robots' maps (``robot_map``)."""

from houseexpo.grids.robot_map import MapError, RobotMap, read_map

__all__ = ["MapError", "RobotMap", "read_map"]
