"""Records of sensors as they come from a logger, read into SI by one reader for calibration and for a node's replay."""
