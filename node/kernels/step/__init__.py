"""One step of a node, and ways to call it."""
