"""Instrument performance models: terms, weighting functions as text, and the data files of the tools."""
