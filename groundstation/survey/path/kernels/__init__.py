"""Compiled loops of the path: the filter of its curvature, and chances within a circle."""
