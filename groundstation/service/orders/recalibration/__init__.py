"""Calibration of a string in a rack, stepped by an operator."""
