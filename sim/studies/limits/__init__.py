"""How near a node is to the best that its data hold."""
