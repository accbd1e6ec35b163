"""A string without frames: its schedule, readings and aiding, and the one kernel that takes every node through them."""
