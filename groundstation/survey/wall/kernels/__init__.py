"""Compiled loops of walls."""
