"""What turns readings into a hole and no reading tells: what is known of it, by whom, since when, and how well."""
