"""How much of the step in C the recorded calls run, and how many of the defects planted in it they notice."""

import os
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from bound_calls import record_bound_calls, seek_bounds
from chip_tools import CHECKED, compile_replay, needs, needs_gcc, run_program
from chip_worlds import alone, every_world, refused_alignments, smoothed_strings
from recorded_calls import record_calls

from node.translation.c_file import CODE, HEADER, CFiles, write_c_files

PLANTED = 200
EVALUATIONS = 1_800_000  # of the search for calls at bounds
SITES = (
    (re.compile(r"(?<=[\w)\]] )([-+]) (?=[\w(])"), r"\1 planted({n}, 1, -1) * "),  # a sum for a difference
    (re.compile(r"(?<=[\w)\]] )(<|>|<=|>=) (?=[\w(])"), r"\1 planted({n}, 0, 1) + "),  # one more or less
    (re.compile(r"(?<=[\w)\]] )(==|!=) (?=[\w(])"), r"\1 planted({n}, 0, 1) + "),
    (re.compile(r"(?<=, )(?=\w+\)(?:;| [-+*]|\)))"), r"planted({n}, 0, 1) + "),  # the last argument of a call
)
EQUIVALENT = {  # defects (at the @) that change nothing, and why; they count as unseen all the same
    "int64_t certain = ONE + @0 * angle;": "0 added or subtracted",
    "int64_t certain = exponential_decay(0, @268435456);": (
        "rate 0: y = multiply_q31(0, dt) = 0 * dt + ((0 * dt + 2^30) >> 31) = 0 for any dt, and nothing else reads dt"
    ),
    "if (k > @0 && config->bias_decay[k] == config->bias_decay[k - 1]) {": (
        "at k = 1 exponential_decay is called although the rate is that of k = 0: a function of rate and dt alone, "
        "it gives what decay[0] was set to just before"
    ),
    "if (whole > @31) {": (
        "at whole = 32 the result is (power * (series >> 8)) >> 63; 0 <= power <= 2^31 (its table) and "
        "0 <= series <= 2^39 (1 - x + x^2 / 2 - x^3 / 6, 0 <= x < 1), so the product is in 0..2^62 and the result 0"
    ),
    "if ((ahead < @0) != (told[PARTS - 1] < 0)) {": (
        "only at ahead = 0 is the condition another, and what it guards is ahead = 0 * ahead"
    ),
}
SWITCH = """
#include <stdlib.h>
static inline int64_t planted(int which, int64_t right, int64_t wrong)
{
    static int chosen = -1;
    if (chosen < 0) {
        const char *text = getenv("PLANTED");
        chosen = text ? atoi(text) : 0;
    }
    return which == chosen ? wrong : right;
}
"""


@pytest.fixture(scope="module")
def written() -> CFiles:
    return write_c_files()


@pytest.fixture(scope="module")
def calls(written: CFiles, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Calls of worlds, and calls at bounds that are sought from them: these first, for they are few."""
    folder = tmp_path_factory.mktemp("calls")
    plain, bound = folder / "calls.bin", folder / "bound.bin"
    record_calls(plain, *every_world(1500), *smoothed_strings(), *refused_alignments(), alone)
    put(written, folder)
    record_bound_calls(bound, plain, seek_bounds(folder, plain, EVALUATIONS))
    return bound, plain


def put(files: CFiles, folder: Path) -> None:
    (folder / HEADER).write_text(files.header)
    (folder / CODE).write_text(files.code)


def plant_switches(code: str, random: np.random.Generator) -> tuple[str, int]:
    """The code with ``PLANTED`` places that go wrong when ``$PLANTED`` says their number, from 1 on; none does at 0."""
    lines = code.split("\n")
    first = next(k for k, line in enumerate(lines) if line.startswith("static const")) if "static const" in code else 0
    found: list[tuple[int, int, int, str]] = []
    inside, structs = False, set(re.findall(r"struct \w+ (\w+)", code))  # names that no number is added to
    for k, line in enumerate(lines):
        inside = (inside or line == "{") and line != "}"
        if k < first or not inside or line.lstrip().startswith(("for (", "static", "/*")):
            continue
        for pattern, made in SITES:
            found.extend(
                (k, match.start(), match.end(), match.expand(made))
                for match in pattern.finditer(line)
                if re.match(r"\w*", line[match.end() :])[0] not in structs
            )
    found.sort()
    chosen = sorted(random.choice(len(found), PLANTED, replace=False))
    for number in reversed(range(PLANTED)):  # from the end of the text, so that places before stay where they are
        k, start, end, made = found[chosen[number]]
        lines[k] = lines[k][:start] + made.format(n=number + 1) + lines[k][end:]
    return "\n".join(lines), len(found)


@needs_gcc
@needs("gcov", "gcc")
@pytest.mark.statistical
@pytest.mark.timeout(1800)
def test_the_calls_run_the_blocks_of_the_code(written: CFiles, calls: tuple[Path, Path], tmp_path: Path) -> None:
    put(written, tmp_path)
    program = compile_replay(tmp_path, "-O0", "--coverage")
    for path in calls:
        assert run_program(program, path, folder=tmp_path).returncode == 0
    said = run_program("gcov", "-a", "-b", "replay-borechain_step.gcda", folder=tmp_path).stdout
    for what in ("Lines executed", "Branches executed"):
        assert float(re.findall(rf"{what}:([\d.]+)%", said)[0]) >= 95.0, said
    blocks = re.findall(r"^ *(\S+): *\d+-block", (tmp_path / f"{CODE}.gcov").read_text(), re.MULTILINE)
    assert len(blocks) > 2000
    assert sum(block.strip("%$") != "" for block in blocks) >= 0.95 * len(blocks)


@needs_gcc
@pytest.mark.statistical
@pytest.mark.timeout(1800)
def test_no_operation_is_undefined_in_the_calls_at_bounds(
    written: CFiles, calls: tuple[Path, Path], tmp_path: Path
) -> None:
    put(written, tmp_path)
    done = run_program(compile_replay(tmp_path, *CHECKED), calls[0], folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr[-2000:]


def is_equivalent(code: str, which: int) -> bool:
    """Whether the list says that a defect planted in the code changes nothing."""
    line = next(line for line in code.split("\n") if f"planted({which}, " in line).strip()
    marked = re.sub(rf"planted\({which}, \d+, -?\d+\) [+*] ", "@", line)
    return re.sub(r"planted\(\d+, \d+, -?\d+\) [+*] ", "", marked) in EQUIVALENT


@needs_gcc
@pytest.mark.statistical
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("seed", [54, 117])
def test_nine_of_ten_planted_defects_are_noticed(
    written: CFiles, calls: tuple[Path, Path], tmp_path: Path, seed: int
) -> None:
    code, _ = plant_switches(written.code, np.random.default_rng(seed))
    code = code.replace(f'#include "{HEADER}"', f'#include "{HEADER}"{SWITCH}', 1)
    put(written._replace(code=code), tmp_path)
    program = compile_replay(tmp_path, "-O2", "-w", "-DENDS_AT_WRONG")

    def is_noticed(which: int, path: Path) -> bool:
        environment = {"PLANTED": str(which)}
        return run_program("timeout", "60", program, path, folder=tmp_path, environment=environment).returncode != 0

    def is_unseen(which: int) -> bool:
        return not any(is_noticed(which, path) for path in calls)

    assert is_unseen(0)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        unseen = [k for k, none in enumerate(pool.map(is_unseen, range(1, PLANTED + 1)), 1) if none]
    equivalent = [k for k in range(1, PLANTED + 1) if is_equivalent(code, k)]
    assert set(equivalent) <= set(unseen)  # whatever is noticed is none
    assert len(unseen) <= PLANTED // 10, unseen
