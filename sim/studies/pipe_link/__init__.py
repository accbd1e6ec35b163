"""Links inside the pipe."""
