"""The commands, a room a family; each imports what it needs when it runs."""
