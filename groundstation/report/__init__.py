"""Reports for people: figures and certificates; knows no service."""
