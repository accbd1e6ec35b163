"""Tuning factors of the filter."""
