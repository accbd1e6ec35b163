"""Commands that calibrate sensors from records."""
