"""What the ground station makes of a bent hole, through which a string carries its yaw parallel."""
