"""A request of a host to a bare chip is taken as long as it has room, and never beyond it."""

import ctypes
import importlib.resources
import re

import pytest
from chip_tools import needs_gcc, run_program

HARNESS = """
int beside(int32_t room, int32_t length, int32_t there)
{
    static char from[64], place[64];
    memset(from, 1, sizeof from);
    memset(place, 7, sizeof place);
    FILE *file = fmemopen(from, (size_t)there, "rb");
    const int taken = take(place, (size_t)room, length, file);
    fclose(file);
    int written = 0;
    for (int k = 0; k < 64; k++) {
        written += place[k] != 7;
    }
    return 100 * taken + written;
}
"""


@needs_gcc
@pytest.mark.parametrize(
    ("room", "length", "there", "found"),
    [
        (16, 16, 40, 116), (16, 15, 40, 115), (16, 0, 40, 100), (16, 17, 40, 0), (16, 24, 40, 0), (16, -1, 40, 0),
        (16, 16, 10, 10),
    ],
)  # fmt: skip
def test_no_request_writes_beyond_its_room(
    tmp_path_factory: pytest.TempPathFactory, room: int, length: int, there: int, found: int
) -> None:
    folder = tmp_path_factory.getbasetemp() / "requests_of_a_chip"
    if not (folder / "t.so").exists():
        folder.mkdir()
        text = importlib.resources.files("node.translation").joinpath("bare/chip_server.c").read_text()
        (taking,) = re.findall(r"^static int take\(.*?^}\n", text, re.DOTALL | re.MULTILINE)
        head = "#define _POSIX_C_SOURCE 200809L\n#include <stdint.h>\n#include <stdio.h>\n#include <string.h>\n"
        (folder / "t.c").write_text(head + taking + HARNESS)
        done = run_program("gcc", "-std=c99", "-shared", "-fPIC", "t.c", "-o", "t.so", folder=folder)
        assert done.returncode == 0, done.stderr
    assert ctypes.CDLL(str(folder / "t.so")).beside(room, length, there) == found
