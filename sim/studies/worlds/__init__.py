"""The figures asked of the filter, in the world it assumes and in a rough one."""
