"""The firmware's C on this machine: compiled with every undefined operation checked, and called through ctypes."""

import ctypes
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Werror")
CHECKED = ("-g", "-O1", "-fsanitize=undefined", "-fno-sanitize-recover=all")
CHECKED_LIBRARY = "checked.so"
C_TYPES = {
    f"{'u' if kind == 'uint' else ''}int{bits}_t": getattr(ctypes, f"c_{kind}{bits}")
    for kind in ("int", "uint")
    for bits in (8, 16, 32, 64)
}
STRUCT = re.compile(r"struct (\w+) \{\n(.*?)\n\};", re.DOTALL)
MEMBER = re.compile(r"^\s*(\w+) (\w+);", re.MULTILINE)
PROGRAM = re.compile(r"#define (\w+) (\w+)$", re.MULTILINE)


def compile_strictly(folder: Path, compiler: str, *words: str | Path) -> subprocess.CompletedProcess[str]:
    """What a compiler says of sources, warnings as errors."""
    command = [compiler, *STRICT, *map(str, words)]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def compile_checked(folder: Path, sources: Sequence[str | Path], *options: str | Path) -> None:
    """Compile sources to a library; an undefined operation in it ends the process and says where."""
    done = compile_strictly(folder, "gcc", *CHECKED, "-shared", "-fPIC", *options, *sources, "-o", CHECKED_LIBRARY)
    assert done.returncode == 0, done.stderr[-2000:]


def load_checked(folder: Path, sources: Sequence[str | Path], *options: str | Path) -> ctypes.CDLL:
    """A library of sources, compiled and loaded."""
    compile_checked(folder, sources, *options)
    return ctypes.CDLL(str(folder / CHECKED_LIBRARY))


def struct_of(header: str, name: str) -> type[ctypes.Structure]:
    """A struct of a header whose members are integers."""
    (members,) = [text for found, text in STRUCT.findall(header) if found == name]
    fields = [(member, C_TYPES[kind]) for kind, member in MEMBER.findall(members)]
    return type(name, (ctypes.Structure,), {"_fields_": fields})


def renamed(header: str) -> dict[str, str]:
    """Names in the library by those that a header gives them."""
    return dict(PROGRAM.findall(header))
