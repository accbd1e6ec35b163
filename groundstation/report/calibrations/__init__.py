"""Calibrations from a request to everything that a command writes of them: object, file, sheet, figures."""
