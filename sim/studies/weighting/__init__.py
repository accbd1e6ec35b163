"""Weights of the readings of one station."""
