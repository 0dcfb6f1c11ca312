"""How people walk: the social force model, their starts, one step of all of them."""
