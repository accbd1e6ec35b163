"""The command of campaigns."""
