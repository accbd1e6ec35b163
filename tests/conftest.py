"""Shared settings of the tests."""

from __future__ import annotations

import os

from hypothesis import settings

# the first example of a property compiles the kernel, which no deadline of an example can foresee; the same commit
# gives the same examples everywhere, and new ones are looked for by `make explore`
settings.register_profile("borechain", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "borechain"))
