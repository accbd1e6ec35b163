"""How much of the step in C the recorded calls run, and how many of the defects planted in it they notice."""

import re
from pathlib import Path

import numpy as np
import pytest
from chip_tools import compile_replay, needs, needs_gcc, run_program
from chip_worlds import every_world, smoothed_strings
from drawn_calls import record_drawn_calls
from recorded_calls import record_calls

from node.translation.c_file import CODE, HEADER, write_c_files

PLANTED = 200
SITES = (
    (re.compile(r"(?<=[\w)\]] )([-+]) (?=[\w(])"), r"\1 planted({n}, 1, -1) * "),  # a sum for a difference
    (re.compile(r"(?<=[\w)\]] )(<|>|<=|>=) (?=[\w(])"), r"\1 planted({n}, 0, 1) + "),  # one more or less
    (re.compile(r"(?<=[\w)\]] )(==|!=) (?=[\w(])"), r"\1 planted({n}, 0, 1) + "),
    (re.compile(r"(?<=, )(?=\w+\)(?:;| [-+*]|\)))"), r"planted({n}, 0, 1) + "),  # the last argument of a call
)
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
def calls(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("calls") / "calls.bin"
    record_calls(path, *every_world(1500), *smoothed_strings())
    return path


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
def test_the_calls_run_the_blocks_of_the_code(calls: Path, tmp_path: Path) -> None:
    written = write_c_files()
    (tmp_path / HEADER).write_text(written.header)
    (tmp_path / CODE).write_text(written.code)
    done = run_program(compile_replay(tmp_path, "-O0", "--coverage"), calls, folder=tmp_path)
    assert done.returncode == 0, done.stdout
    said = run_program("gcov", "-b", "replay-borechain_step.gcda", folder=tmp_path).stdout
    lines, branches = (
        float(re.findall(rf"{what}:([\d.]+)%", said)[0]) for what in ("Lines executed", "Branches executed")
    )
    assert lines >= 95.0
    assert branches >= 95.0


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("drawn") / "calls.bin"
    record_drawn_calls(path, 1, 5, *every_world(150))
    return path


@needs_gcc
@pytest.mark.statistical
@pytest.mark.timeout(1800)
def test_three_of_four_planted_defects_are_noticed(calls: Path, drawn: Path, tmp_path: Path) -> None:
    """151 of 200 so far, 133 of them by the calls of worlds: most that are not shift a bound by one count.

    The aim is 180. Of the drawn calls some have no meaning in either language, so what is said is compared.
    """
    written = write_c_files()
    code, _ = plant_switches(written.code, np.random.default_rng(54))
    (tmp_path / HEADER).write_text(written.header)
    (tmp_path / CODE).write_text(code.replace(f'#include "{HEADER}"', f'#include "{HEADER}"{SWITCH}', 1))
    program = compile_replay(tmp_path, "-w")

    def said(which: int, path: Path) -> str:
        environment = {"PLANTED": str(which)}
        done = run_program("timeout", "30", program, path, folder=tmp_path, environment=environment)
        return f"{done.returncode} {done.stdout}"

    plain = {path: said(0, path) for path in (calls, drawn)}
    assert plain[calls].startswith("0 ")
    noticed = [any(said(k, path) != plain[path] for path in (calls, drawn)) for k in range(1, PLANTED + 1)]
    assert sum(noticed) >= 145, [k for k, seen in enumerate(noticed, 1) if not seen]
