"""Build a data set: track the inputs, store the results, report the outcomes."""
