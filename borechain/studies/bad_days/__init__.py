"""Days on which five to eight mild disturbances come together: what nodes and a ground station leave untold."""
