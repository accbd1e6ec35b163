"""Shared settings of the tests."""

from __future__ import annotations

from hypothesis import settings

# the first example of a property compiles the kernel, which no deadline of an example can foresee
settings.register_profile("borechain", deadline=None)
settings.load_profile("borechain")
