"""Whether a node knows its own error at every hop, by relay scheme."""
