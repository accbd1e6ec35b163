"""What is believed of rates, aidings and turns: gates, doubts, faults."""
