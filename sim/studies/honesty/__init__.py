"""Thousands of long strings, and whether their nodes know their own error."""
