"""Walking people: the social force model, their starts, and a step of all of them."""
