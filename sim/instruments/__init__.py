"""Synthetic jigs, ovens and records of a calibration laboratory."""
