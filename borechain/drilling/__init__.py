"""A rig that is drilled: in real processes, or with objects in this one."""
