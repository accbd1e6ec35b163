"""What becomes of blunders of set-up, sensors, depth and crew: named, doubted, or too small to matter."""
