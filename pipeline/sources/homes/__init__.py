"""Generated homes that resemble published ones: draw requirements from statistics, lay them out, build a level."""
