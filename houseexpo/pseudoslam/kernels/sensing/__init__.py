"""Laser scans by sector or by rays, ranges, their noise, and visibility."""
