"""Compiled mathematics of one node: pure functions over records, no allocation, no I/O, no globals."""
