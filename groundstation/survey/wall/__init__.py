"""Walls, shafts and grids of bored columns: joints, voids, verdict."""
