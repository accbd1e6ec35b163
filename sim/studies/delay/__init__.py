"""Delay of the aiding."""
