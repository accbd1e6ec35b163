"""Commands that run a rig or a part of its world."""
