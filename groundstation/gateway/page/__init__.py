"""The page: the ground station's answers and orders over HTTP, and the screen that shows them in a browser."""
