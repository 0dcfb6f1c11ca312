"""Worlds made from plans: rasters, their cache, obstacles, people, and the start of episodes (``reset``)."""
