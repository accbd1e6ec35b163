"""Calibration of synthetic MWD tools."""
