"""From raw readings to one corrected reading of the tube: calibration, cluster, alignment, static records."""
