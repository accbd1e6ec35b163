"""Compiled parts of the adjustment: pure functions over arrays."""
