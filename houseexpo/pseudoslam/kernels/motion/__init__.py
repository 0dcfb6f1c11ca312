"""Motion of a disc among obstacles, and the geometry of moving obstacles."""
