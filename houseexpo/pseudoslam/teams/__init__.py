"""Several robots in one house: the environment, their radios, and the measures of a team."""
