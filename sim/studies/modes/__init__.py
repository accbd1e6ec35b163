"""Update modes, single updates, two nodes and fifty: one study in four tables."""
