"""Commands that rerun published experiments."""
