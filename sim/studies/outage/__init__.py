"""Consistency of five nodes over outages and losses."""
