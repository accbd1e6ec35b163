"""Links through soil, from tube end to tube end."""
