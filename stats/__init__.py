"""Statistics of data sets: measures of a plan, summaries that can be merged, reports."""
