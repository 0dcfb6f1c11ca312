"""Houses made by the project that look like published ones: from a wish drawn from statistics to a level."""
