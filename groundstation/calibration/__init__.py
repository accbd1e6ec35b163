"""Calibration mathematics, its records and its result; knows no service."""
