"""Consistency of fifty nodes."""
