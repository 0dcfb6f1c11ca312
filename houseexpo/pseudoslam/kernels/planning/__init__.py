"""Planning on grids: distances to a goal and to rooms, frontiers, graphs, and travels on the robot's map."""
