"""Files of simulated runs: CARMEN logs, ROS bags, movies, pairs of maps."""
