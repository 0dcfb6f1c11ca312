"""A benchmark of policies with fixed tasks, plans and starts, whose results can be compared and cited."""
