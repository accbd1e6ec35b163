"""Mount of an IMU from slow turns."""
