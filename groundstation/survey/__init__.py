"""Survey mathematics; knows no service."""
