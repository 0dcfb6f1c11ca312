"""Simulated robots in a running ROS 2 graph, without a ROS installation: ``houseexpo ros``."""
