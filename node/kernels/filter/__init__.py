"""The error-state filter of a node; what both arithmetics share."""
