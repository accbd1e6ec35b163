"""Where holes end, foreseen from every depth, against where they do."""
