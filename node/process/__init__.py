"""A node as an operating-system process: configuration, saved state on disk, telemetry."""
