"""What a data set is made of: measures of a plan, summaries that add up, reports."""
