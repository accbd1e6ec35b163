"""Links between tubes: what a radio hears through soil and pipe."""
