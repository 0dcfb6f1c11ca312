"""One small tree of exceptions; every text says which thing, what was expected, what was found, what to do."""


class HouseExpoError(Exception):
    """Root of every error that houseexpo raises on purpose."""


class PlanError(HouseExpoError):
    """A floor plan, or a file that should hold one, breaks the format."""


class ConfigError(HouseExpoError):
    """A configuration, manifest or command-line value cannot be used."""


class MissingDependencyError(HouseExpoError):
    """An optional library is needed for what was asked and is not installed."""
