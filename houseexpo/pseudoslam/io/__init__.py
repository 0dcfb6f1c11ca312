"""Files of simulated runs: ROS bags, movies, pairs of maps."""
