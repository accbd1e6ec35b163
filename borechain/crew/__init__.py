"""The crew's view of a rig in a terminal, and the log of a rig whose output is redirected."""
