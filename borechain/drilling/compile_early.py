"""A rig's kernels compiled while the rest of an environment is still being installed: ``deploy/set_up_shown.py``.

The first line of its output says how many functions there are, about; another one follows for each that is compiled.
It needs numba and numpy, and no other package.
"""

from __future__ import annotations

import sys

from borechain.drilling.compile_ahead import count_about, lacking_parts
from borechain.drilling.kernel_parts import compile_beside, end_when_told

if __name__ == "__main__":
    end_when_told()
    lacking = lacking_parts("float64")
    if lacking:
        sys.stdout.write(f"{count_about(lacking)}\n")
        sys.stdout.flush()
        compile_beside(lacking)
