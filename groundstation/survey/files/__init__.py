"""Survey records and programmes as files."""
