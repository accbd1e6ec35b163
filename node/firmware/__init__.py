"""What runs on the tube, one function an event: no clock, no bus, no files."""
