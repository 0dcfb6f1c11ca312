"""Plane geometry that several stages need: cutting, walls from segments, regions, passages, straight lines."""
