"""Compiled loops of the hole."""
