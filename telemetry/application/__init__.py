"""Who talks to whom: neighbours, time, surveys, commands."""
