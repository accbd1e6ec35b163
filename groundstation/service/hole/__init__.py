"""The hole as it was surveyed: resolved stops, stations, trajectory, deviations, neighbours. No I/O."""
