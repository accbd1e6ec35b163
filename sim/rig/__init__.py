"""A whole rig: its schedule, its joints, its processes and its result."""
