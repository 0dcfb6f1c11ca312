"""How a disc moves among obstacles, and the geometry of bodies that move by themselves."""
