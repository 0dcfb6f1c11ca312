"""Where things are set down: shapes as cells, obstacles, cells drawn at random."""
