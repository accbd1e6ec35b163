"""Walls judged by drawing them: an independent Monte Carlo that knows circles and normal numbers only."""

import numpy as np


def joint_thickness(first: np.ndarray, second: np.ndarray, r1: np.ndarray, r2: np.ndarray) -> np.ndarray:
    """Distance of the two points where circles (n, 2) meet; negative the gap between them."""
    d = np.linalg.norm(second - first, axis=-1)
    s = 0.5 * (d + r1 + r2)  # Heron: the chord is four times the triangle's area over its base
    area = np.sqrt(np.maximum(s * (s - d) * (s - r1) * (s - r2), 0.0))
    return np.where(d < r1 + r2, 4.0 * area / d, r1 + r2 - d)


def uncovered(centres: np.ndarray, radii: np.ndarray, half: float, steps: int = 41) -> np.ndarray:
    """Whether a point of a square of +-half about the mean of the centres (n, c, 2) lies in no disc (n, c)."""
    middle = centres.mean(axis=1)
    grid = np.linspace(-half, half, steps)
    x, y = np.meshgrid(grid, grid)
    out = np.zeros(len(centres), bool)
    for k, (cx, cy) in enumerate(middle):
        free = np.ones(x.shape, bool)
        for (ax, ay), r in zip(centres[k], radii[k], strict=True):
            free &= (x + cx - ax) ** 2 + (y + cy - ay) ** 2 > r**2
        out[k] = np.any(free)
    return out
