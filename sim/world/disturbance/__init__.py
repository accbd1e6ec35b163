"""What makes a reading another one than that of a perfect sensor: one module each, one table, one reading."""
