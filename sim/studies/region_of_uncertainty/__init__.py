"""Regions of uncertainty of wellbore 1."""
