"""Where the plans of a data set come from, and the caches that make them quick to reach."""
