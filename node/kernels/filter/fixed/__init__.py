"""The filter in integers."""
