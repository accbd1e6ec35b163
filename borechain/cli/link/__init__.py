"""Links between tubes: what a radio hears through soil and pipe, and what a CAN bus carries."""
