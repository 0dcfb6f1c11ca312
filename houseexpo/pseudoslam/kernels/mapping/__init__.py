"""The map that the robot draws: merging scans, and cutting out the view."""
