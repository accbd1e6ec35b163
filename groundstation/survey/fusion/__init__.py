"""From the readings of a stop to one direction: resolution, trust, what readings share."""
