"""A benchmark of policies: fixed tasks, fixed plans, fixed starts; results that can be compared and cited."""
