"""The robot's map: merging scans, and cropping the view."""
