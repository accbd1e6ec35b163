"""A size and its ± as people read them: centimetres, as many digits as the ± is worth, the ± never told too small."""

from __future__ import annotations

import math

FINEST_CM = 0.1  # cm, of a line for a screen
WHOLE_FROM_CM = 10.0  # cm, of a ± from which on whole centimetres are enough
CM = 100.0


def spread_text(size: float, half_width: float) -> str:
    """``38 ± 12 cm`` or ``43.8 ± 0.2 cm`` of a size and a half width (m)."""
    if not math.isfinite(half_width):
        return f"{CM * size:.1f} ± ? cm"
    spread = max(CM * half_width, FINEST_CM)
    places = 0 if spread >= WHOLE_FROM_CM else 1
    step = 10.0**-places
    return f"{CM * size:.{places}f} ± {math.ceil(spread / step - 1e-9) * step:.{places}f} cm"
