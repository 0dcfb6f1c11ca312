"""Plans as worlds: rasters, their cache, obstacles, people, and how an episode starts in one (``reset``)."""
