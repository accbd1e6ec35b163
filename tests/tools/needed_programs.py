"""What a test needs of the machine, by the name of the package that has it."""

import shutil

import pytest


def needs(program: str, package: str) -> pytest.MarkDecorator:
    """Skip a test where a program is not installed, by the name of Debian's package."""
    return pytest.mark.skipif(shutil.which(program) is None, reason=f"needs {program}: install Debian's {package}")


needs_gcc = needs("gcc", "gcc")
needs_clang = needs("clang", "clang")
