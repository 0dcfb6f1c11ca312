"""Houses that the project makes itself, in SUNCG's own layout, each with its truth."""
