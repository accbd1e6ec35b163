"""What gyroscopes that bridge outages together could gain."""
