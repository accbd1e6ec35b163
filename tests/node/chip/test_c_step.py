"""The integer step in C beside what numba compiles of the same kernels, call by call; and what its files are like.

The oracle is the numba step; the C is made from the source by another translator and compiled by another compiler.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from chip_tools import CHECKED, TRAPPED, compile_replay, layout_of_one, needs, needs_gcc, run_program, said_numbers
from chip_worlds import every_world, rough_node
from drawn_calls import record_drawn_calls
from recorded_calls import record_calls

from node.translation.c_file import CODE, HEADER, CFiles, write_c_files
from node.translation.imu_limit import write_for_imus


@pytest.fixture(scope="module")
def written() -> CFiles:
    return write_c_files()


@pytest.fixture(scope="module")
def for_one() -> CFiles:
    """The step of a node of one IMU, which a process of its own writes."""
    return write_for_imus(1)


def put(files: CFiles, folder: Path) -> Path:
    (folder / HEADER).write_text(files.header)
    (folder / CODE).write_text(files.code)
    return folder


@pytest.fixture(scope="module")
def built(written: CFiles, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return put(written, tmp_path_factory.mktemp("step"))


@pytest.fixture(scope="module")
def calls(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calls") / "calls.bin"
    assert record_calls(path, *every_world(700)) > 12_000
    return path


@needs_gcc
@pytest.mark.slow
def test_every_call_is_equal_bit_for_bit(built: Path, calls: Path) -> None:
    done = run_program(compile_replay(built), calls, folder=built)
    found = said_numbers(done.stdout)
    assert (done.returncode, found["wrong"]) == (0, 0), done.stdout
    assert found["calls"] > 12_000


@needs_gcc
@pytest.mark.slow
def test_calls_from_records_that_no_world_leads_to_are_equal(built: Path, tmp_path: Path) -> None:
    """But for one in a hundred that neither language gives a meaning to: a product beyond 64 bits and the like."""
    worlds = (rough_node(2, 3, 2, 150), rough_node(6, 1, 0, 150), rough_node(8, 2, 2, 150))
    made = record_drawn_calls(tmp_path / "calls.bin", 1, 8, *worlds)
    done = run_program(compile_replay(built, *TRAPPED, name="trapped"), tmp_path / "calls.bin", folder=built)
    found = said_numbers(done.stdout)
    assert (found["calls"], found["wrong"], done.returncode) == (made, 0, 0), done.stdout
    assert found["undefined"] < made / 100


@needs_gcc
@pytest.mark.slow
def test_no_operation_is_undefined_and_no_place_is_outside_its_array(built: Path, calls: Path) -> None:
    """Without -fwrapv: a sum beyond 64 bits would be found, and so would a shift by 64 or a quotient by 0."""
    done = run_program(compile_replay(built, *CHECKED, name="checked"), calls, folder=built)
    assert done.returncode == 0, done.stderr[-2000:]


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("return value >> places;", "return value >> (places + 62);", "shift exponent"),
        ("events->told += 1;", "events->told += INT64_C(0x7FFFFFFFFFFFFFFF);", "signed integer overflow"),
        ("events->ring[events->told & (EVENTS_KEPT - 1)]", "events->ring[events->told + EVENTS_KEPT]", "out of bounds"),
    ],
)
def test_an_undefined_operation_is_found(
    written: CFiles, calls: Path, tmp_path: Path, right: str, wrong: str, said: str
) -> None:
    assert right in written.code
    spoilt = put(written._replace(code=written.code.replace(right, wrong)), tmp_path)
    done = run_program(compile_replay(spoilt, *CHECKED), calls, folder=tmp_path)
    assert done.returncode != 0
    assert said in done.stderr


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        (
            "P[TY][j] = multiply_q31(ty, c) - multiply_q31(tx, s)",
            "P[TY][j] = multiply_q31(ty, c) + multiply_q31(tx, s)",
        ),
        ("#define LOW31 2147483647", "#define LOW31 1073741823"),
        ("repeats->counts[k] + 1 : 0", "repeats->counts[k] + 2 : 0"),
        ("    state->cycles += 1;", "    state->cycles += 2;"),
    ],
)
def test_a_planted_defect_is_noticed(written: CFiles, calls: Path, tmp_path: Path, right: str, wrong: str) -> None:
    assert right in written.code
    spoilt = put(written._replace(code=written.code.replace(right, wrong, 1)), tmp_path)
    assert run_program(compile_replay(spoilt), calls, folder=tmp_path).returncode == 1


@needs_gcc
@pytest.mark.slow
def test_records_with_room_for_one_imu_give_the_same(for_one: CFiles, tmp_path: Path) -> None:
    folder, path = put(for_one, tmp_path), tmp_path / "calls.bin"
    assert record_calls(path, rough_node(6, 1, 0, 700), rough_node(2, 3, 2, 40), layout=layout_of_one()) > 1000
    for name, options in (("replay", ()), ("checked", CHECKED)):
        done = run_program(compile_replay(folder, *options, name=name), path, folder=folder)
        assert (done.returncode, said_numbers(done.stdout)["wrong"]) == (0, 0), done.stdout + done.stderr[-2000:]


@needs_gcc
@pytest.mark.slow
def test_a_node_of_more_imus_than_there_is_room_for_is_refused(for_one: CFiles, tmp_path: Path) -> None:
    folder = put(for_one, tmp_path)
    (folder / "two.c").write_text("""\
#include "borechain_step.h"
static struct borechain_node node, before;
static struct borechain_settings settings;
static int64_t aiding[12];
int main(void)
{
    const unsigned char *one = (const unsigned char *)&node, *other = (const unsigned char *)&before;
    settings.imus = 2;
    int64_t answer = borechain_aiding(&node, &settings, aiding);
    for (unsigned k = 0; k < sizeof node; k++) {
        if (one[k] != other[k]) {
            return 1;
        }
    }
    return answer == BORECHAIN_OTHER_LAYOUT ? 0 : 2;
}
""")
    assert run_program("gcc", "two.c", CODE, "-o", "two", folder=folder).returncode == 0
    assert run_program(folder / "two", folder=folder).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("compiler", [pytest.param(name, marks=needs(name, name)) for name in ("gcc", "clang")])
@pytest.mark.parametrize("imus", [1, 8])
def test_a_compiler_has_no_word_to_say(
    compiler: str, imus: int, written: CFiles, for_one: CFiles, tmp_path: Path
) -> None:
    options = ("-std=c99", "-pedantic", "-Os", "-Wall", "-Wextra", "-Wconversion", "-Werror")
    folder = put({1: for_one, 8: written}[imus], tmp_path)
    unheard = () if imus > 1 else ("-Wno-array-bounds",)  # gcc follows loops over more IMUs than are admitted
    done = run_program(compiler, *options, *unheard, "-c", CODE, folder=folder)
    assert (done.returncode, done.stderr) == (0, "")


@needs_gcc
def test_a_header_of_another_source_does_not_link(written: CFiles, tmp_path: Path) -> None:
    put(written, tmp_path)
    assert run_program("gcc", "-c", CODE, folder=tmp_path).returncode == 0
    (tmp_path / HEADER).write_text(written.header.replace(written.digest, "0123456789abcdef"))
    (tmp_path / "main.c").write_text(
        f'#include "{HEADER}"\nint main(void)\n{{\n    return (int)borechain_aiding(0, 0, 0);\n}}\n'
    )
    done = run_program("gcc", "main.c", "borechain_step.o", "-o", "main", folder=tmp_path)
    assert done.returncode != 0
    assert "borechain_aiding_0123456789abcdef" in done.stderr


@pytest.mark.slow
def test_the_same_source_gives_the_same_bytes(written: CFiles) -> None:
    """In another process, whose sets and hashes have another order."""
    code = "from node.translation.c_file import write_c_files as w; print(w().header + w().code, end='')"
    for seed in ("1",):
        done = subprocess.run(
            [sys.executable, "-c", code], env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, text=True,
            check=True,
        )  # fmt: skip
        assert done.stdout == written.header + written.code


def test_the_code_names_functions_fields_and_units_of_the_source(written: CFiles) -> None:
    assert "static void queue_event(struct borechain_node *node, int64_t code," in written.code
    assert "state->ring_rate[slot][k] = rate[k];" in written.code
    assert "int64_t static_bias[3]; /* rad/s, Q46 */" in written.header
    assert "int64_t raw_force[3]; /* g, likewise, Q26 */" in written.header
    assert "LIES_AT(borechain_state, now_yaw," in written.header
    assert re.findall("float|double", re.sub(r"/\*.*?\*/", "", written.code, flags=re.DOTALL)) == []
