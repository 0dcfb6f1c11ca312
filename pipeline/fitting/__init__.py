"""Fit the models that rate the parts of plans (``stages.logistic``) on what people say is true of houses."""
