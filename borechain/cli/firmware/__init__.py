"""``borechain firmware``: the step of a node for a chip."""
