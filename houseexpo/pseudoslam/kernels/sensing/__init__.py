"""What a laser returns: scans by sector or by rays, ranges, their noise, and what can be seen from where."""
