"""What can be measured on a plan: its graph, walking distances, where a robot fits, walls, likeness to others."""
