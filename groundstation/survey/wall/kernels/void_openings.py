"""Whether the plane is open between three columns, in many drawn walls at all depths.

The power centre of three discs (centres p, radii r) has the same power |x - p|^2 - r^2 to each. A void is deepest
there, so the plane is open where that point lies among the three and outside of them and of every disc near them.
Frame: the plane across the columns; m.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.jit import kernel

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
SLACK, RELATIVE_SLACK = 1e-12, 1e-9  # m^2, by which a point may lie beyond a side and counts as on it


@kernel
def mark_open(centres: Array, radii: Array, three: Indices, near: Indices, out: npt.NDArray[np.bool_]) -> None:
    """Set ``out`` (samples, depths) where the plane between the columns ``three`` (3,) is open.

    Parameters
    ----------
    centres, radii : (columns, samples, depths, 2) and (columns, samples, depths) m; nan where a column is not there
    near : (m,) columns that may cover the point between the three
    """
    a, b, c = three
    for s in range(out.shape[0]):
        for z in range(out.shape[1]):
            # from the first centre, so that the site's coordinates cost no digits
            ox, oy, ra = centres[a, s, z, 0], centres[a, s, z, 1], radii[a, s, z]
            bx, by, rb = centres[b, s, z, 0] - ox, centres[b, s, z, 1] - oy, radii[b, s, z]
            cx, cy, rc = centres[c, s, z, 0] - ox, centres[c, s, z, 1] - oy, radii[c, s, z]
            right_b = 0.5 * (bx * bx + by * by - rb * rb + ra * ra)
            right_c = 0.5 * (cx * cx + cy * cy - rc * rc + ra * ra)
            det = bx * cy - by * cx
            x, y = (right_b * cy - by * right_c) / det, (bx * right_c - right_b * cx) / det
            # nan of a column that is not there answers no
            if not x * x + y * y > ra * ra:
                continue
            ab, bc, ca = bx * y - by * x, (cx - bx) * (y - by) - (cy - by) * (x - bx), cx * (cy - y) - cy * (cx - x)
            slack = SLACK + RELATIVE_SLACK * max(abs(ab), abs(bc), abs(ca))
            left = ab >= -slack and bc >= -slack and ca >= -slack
            right = ab <= slack and bc <= slack and ca <= slack
            if not (left or right):
                continue
            covered = False
            for k in near:
                dx, dy = ox + x - centres[k, s, z, 0], oy + y - centres[k, s, z, 1]
                if dx * dx + dy * dy < radii[k, s, z] * radii[k, s, z]:
                    covered = True
                    break
            if not covered:
                out[s, z] = True
