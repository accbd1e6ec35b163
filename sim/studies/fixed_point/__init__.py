"""The integer kernel against the float64 kernel."""
