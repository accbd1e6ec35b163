"""The command that runs a rig under faults."""
