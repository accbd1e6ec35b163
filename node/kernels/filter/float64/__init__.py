"""The filter in floats."""
