"""How messages are written."""
