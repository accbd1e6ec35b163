"""Sources of readings on a board: sensors over a bus, counters in files, recordings."""
