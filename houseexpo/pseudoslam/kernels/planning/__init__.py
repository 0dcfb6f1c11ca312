"""Shortest paths on a grid: to a goal (``distance_field``), and to the rooms of a house (``flow``)."""
