"""Holes and walls as files of other programs."""
