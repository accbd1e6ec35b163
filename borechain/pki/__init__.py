"""Keys and certificates of a rig, made from a folder that fits on a stick."""
