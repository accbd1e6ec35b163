"""What a user asks of surveys, as typed settings, and what is answered: objects for JSON, rows for tables."""
